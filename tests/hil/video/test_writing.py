"""Video files: kinds, places, and that they are whole or not there."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import av
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from hil.video.caption import write_caption
from hil.video.writing import refuse_unwritable, write_video
from ident.errors import UserError

SHAPE = (90, 160, 3)


def pictures(count: int) -> Iterator[NDArray[np.uint8]]:
    """A grey bar that grows from the left, on green."""
    for index in range(count):
        picture = np.empty(SHAPE, np.uint8)
        picture[:] = (20, 160, 60)
        picture[:, : 10 * (index + 1)] = 200
        yield picture


@pytest.mark.parametrize("ending", [".mp4", ".gif", ".GIF"])
def test_what_was_written_is_read_back(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"video{ending}"
    write_video(pictures(12), path, 20)
    with av.open(str(path)) as file:
        assert file.streams.video[0].average_rate == 20
        found = [frame.to_ndarray(format="rgb24") for frame in file.decode(video=0)]
    assert len(found) == 12
    for index, (expected, seen) in enumerate(zip(pictures(12), found, strict=True)):
        assert np.abs(expected.astype(int) - seen).mean() < 4, index
    assert list(tmp_path.iterdir()) == [path]


def test_a_gif_plays_on_and_on_at_its_rate(tmp_path: Path) -> None:
    write_video(pictures(5), path := tmp_path / "video.gif", 25)
    with Image.open(path) as image:
        assert (image.n_frames, image.info["loop"], image.info["duration"]) == (5, 0, 40)


def test_a_video_that_fails_half_way_leaves_what_was_there(tmp_path: Path) -> None:
    path = tmp_path / "video.mp4"
    path.write_bytes(b"before")

    def failing() -> Iterator[NDArray[np.uint8]]:
        yield from pictures(8)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_video(failing(), path, 20)
    assert path.read_bytes() == b"before"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("video.avi", "ending"),
        ("video", "ending"),
        ("folder.mp4", "is a folder"),
        ("file/video.mp4", "cannot be written"),
        ("/proc/nowhere/video.mp4", "cannot be written"),
    ],
)
def test_what_could_not_be_written_is_refused_before_the_drive(tmp_path: Path, name: str, said: str) -> None:
    (tmp_path / "folder.mp4").mkdir()
    (tmp_path / "file").write_text("")
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(UserError, match=said):
        refuse_unwritable(tmp_path / name)
    refuse_unwritable(tmp_path / "new" / "folder" / "video.gif")
    assert sorted(tmp_path.rglob("*")) == before


def test_the_text_is_below_the_picture_and_says_what_and_when() -> None:
    picture = np.full((720, 1280, 3), 128, np.uint8)
    steering, again, later, rotation = (
        write_caption(picture, caption, time)
        for caption, time in (
            ("steering_left", 1.0),
            ("steering_left", 1.0),
            ("steering_left", 1.04),
            ("rotation", 1.0),
        )
    )
    assert np.array_equal(steering, again)
    assert np.array_equal(steering[:658], picture[:658])
    changed = [np.nonzero((steering != other).any(axis=(0, 2)))[0] for other in (later, rotation)]
    assert changed[0].min() > 1100
    assert changed[1].max() < 400


def test_a_long_caption_does_not_cover_the_time() -> None:
    picture = np.full((720, 1280, 3), 128, np.uint8)
    short, long = (write_caption(picture, caption, 12.34) for caption in ("a", "a" + " long caption" * 30))
    assert np.array_equal(short[:, 1120:], long[:, 1120:])

"""Video files, by PyAV: MP4 (H.264) and GIF. Whole or not there."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import av
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ident.errors import UserError
from ident.writing import refuse_folder, unwritable, write_by

Picture = NDArray[np.uint8]
"""(height, width, 3): red, green, blue."""

_COLOURS: Final = 256
"""That a GIF has."""


def refuse_unwritable(path: Path) -> None:
    """Refuse the name of a video that could not be written in the end; nothing is left behind.

    Raises:
        UserError: of an unknown kind, a folder, or in a place that cannot be written.
    """
    if path.suffix.lower() not in _WRITERS:
        raise UserError(
            f"{path} has the ending of no video that can be written.", f"Let it end in {' or '.join(_WRITERS)}."
        )
    refuse_folder(path)
    place = next(folder for folder in path.absolute().parents if folder.exists())
    try:
        with tempfile.TemporaryFile(dir=place):
            pass
    except OSError as error:
        raise unwritable(path, error) from error


def write_video(pictures: Iterable[Picture], path: Path, rate: int) -> None:
    """Write pictures of one size as a video; whole or not there.

    Args:
        pictures: at least one; taken one by one.
        path: whose ending says the kind.
        rate: pictures a second.

    Raises:
        UserError: it cannot be written.
    """
    write_by(lambda part: _WRITERS[path.suffix.lower()](iter(pictures), part, rate), path)


def _write_mp4(pictures: Iterator[Picture], path: Path, rate: int) -> None:
    frames = (av.VideoFrame.from_ndarray(picture, format="rgb24") for picture in pictures)
    # The index ahead of the pictures: a browser shows the first before it has the last.
    _encode(frames, path, rate, "mp4", "libx264", "yuv420p", {"movflags": "faststart"})


def _write_gif(pictures: Iterator[Picture], path: Path, rate: int) -> None:
    _encode(_in_colours_of_the_first(pictures), path, rate, "gif", "gif", "pal8", {})


def _in_colours_of_the_first(pictures: Iterator[Picture]) -> Iterator[Any]:
    """Frames of one palette, so that what stands still does not flicker."""
    first = next(pictures)
    palette = Image.fromarray(first).quantize(_COLOURS)
    colours = np.zeros((_COLOURS, 4), np.uint8)
    colours[:, 0] = 255
    few = np.asarray(palette.getpalette(), np.uint8).reshape(-1, 3)
    colours[: len(few), 1:] = few
    for picture in _first_again(first, pictures):
        indices = np.asarray(Image.fromarray(picture).quantize(palette=palette, dither=Image.Dither.NONE))
        # Its annotations leave out what it takes for `pal8`.
        pair: Any = (indices, colours)
        yield av.VideoFrame.from_ndarray(pair, format="pal8")


def _first_again(first: Picture, others: Iterator[Picture]) -> Iterator[Picture]:
    yield first
    yield from others


def _encode(
    frames: Iterable[Any], path: Path, rate: int, container: str, codec: str, pixels: str, options: dict[str, str]
) -> None:
    with av.open(str(path), "w", format=container, options=options) as file:
        stream: Any = None
        for frame in frames:
            if stream is None:
                stream = file.add_stream(codec, rate=rate)
                stream.width, stream.height, stream.pix_fmt = frame.width, frame.height, pixels
            file.mux(stream.encode(frame))
        file.mux(stream.encode())


_WRITERS: Final[Mapping[str, Callable[[Iterator[Picture], Path, int], None]]] = {
    ".mp4": _write_mp4,
    ".gif": _write_gif,
}
"""What writes files of an ending."""

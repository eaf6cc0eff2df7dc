"""`--video` on the command line."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest

STEPS = ("wheel_lifted", "steering_left", "steering_right", "straight", "lane_change")


def test_a_campaign_shows_step_after_step(quasi: Callable[..., Any], tmp_path: Path) -> None:
    video = tmp_path / "seen.mp4"
    left_out = [word for step in STEPS for word in ("--skip", step)]
    answer = quasi(
        "campaign", "--out", tmp_path / "run", *left_out, "--periods", 4, "--video", video, "--video-rate", 1
    )
    assert answer.code == 0
    assert "The video is" in answer.out
    with av.open(str(video)) as file:
        pictures = [frame.to_ndarray(format="rgb24") for frame in file.decode(video=0)]
    texts = [picture[670:715, :1000].astype(int) for picture in pictures]
    kinds: list[int] = []
    seen: list[Any] = []
    for text in texts:
        known = [index for index, other in enumerate(seen) if np.abs(text - other).max() < 100]
        seen += [] if known else [text]
        kinds.append(known[0] if known else len(seen) - 1)
    # At rest, aligning for rotation (one attempt or more), rotation for most of the time, at rest.
    assert kinds[0] == 0
    assert len(seen) >= 3
    assert max(map(kinds.count, kinds)) > len(kinds) / 2


@pytest.mark.parametrize("command", ["demo", "campaign", "emulate"])
def test_a_file_that_cannot_be_a_video_is_refused_before_anything_is_done(
    quasi: Callable[..., Any], tmp_path: Path, command: str
) -> None:
    folder = tmp_path / "folder.mp4"
    folder.mkdir()
    where = ("--bus", f"unix:{tmp_path / 'bus'}") if command == "emulate" else ("--out", tmp_path / "run")
    for video, said in ((tmp_path / "a.avi", "ending"), (folder, "is a folder"), (Path("/proc/x/a.gif"), "written")):
        answer = quasi(command, *where, "--video", video)
        assert answer.code == 2
        assert said in answer.error
        assert answer.out == ""
    assert list(tmp_path.iterdir()) == [folder]


def test_a_real_vehicle_and_an_fmu_are_not_drawn(quasi: Callable[..., Any], tmp_path: Path) -> None:
    bus = quasi("campaign", "--bus", "unix:/nowhere", "--out", tmp_path / "run", "--video", tmp_path / "a.mp4")
    assert bus.code == 2
    assert "--video" in bus.error


def test_without_a_video_nothing_of_it_is_loaded() -> None:
    code = (
        "import sys, quasiomni; quasiomni.load_commands(['demo', 'emulate']);"
        "from hil.bench import emulation; from hil.network import DEFAULT_NETWORK;"
        "opened = emulation.bench('prototype', 1, False, DEFAULT_NETWORK); opened.__enter__();"
        "unneeded = ('av', 'PIL', 'hil.video');"
        "print([name for name in sys.modules if name in unneeded])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"

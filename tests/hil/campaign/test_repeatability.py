"""One seed, one campaign: frames are identical; another seed redraws noise and excitation."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import can
import pytest

from hil.campaign.folder import Run
from hil.recorder import LogFormat, finished_steps
from ident.estimate.identify import KnownInertia
from ident.records.record import Step

Frames = list[tuple[float, int, bytes]]


def frames_of(run: Run) -> Frames:
    frames: Frames = []
    for _, path in finished_steps(run.folder.frames):
        with can.LogReader(path) as reader:
            frames += [(message.timestamp, message.arbitration_id, bytes(message.data)) for message in reader]
    return frames


@pytest.fixture(scope="module")
def steer(drive: Callable[..., Run]) -> Callable[[Path, int], Frames]:
    def run(folder: Path, seed: int) -> Frames:
        inertia = KnownInertia(0.121, 0.001, "given")
        return frames_of(drive(folder, [Step.ROTATION], seed=seed, known_inertia=inertia, log_format=LogFormat.CANDUMP))

    return run


def test_two_runs_with_one_seed_give_identical_frames(steer: Callable[[Path, int], Frames], tmp_path: Path) -> None:
    first, second = steer(tmp_path / "first", 5), steer(tmp_path / "second", 5)
    assert len(first) > 100_000
    assert first == second


def test_another_seed_gives_another_campaign(steer: Callable[[Path, int], Frames], tmp_path: Path) -> None:
    assert steer(tmp_path / "first", 5) != steer(tmp_path / "second", 6)

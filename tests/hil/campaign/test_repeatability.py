"""One seed, one campaign: frames are identical; another seed redraws noise and excitation."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from hil.campaign.folder import Run
from hil.frames.recorder import LogFormat, finished_steps
from ident.estimate.result import KnownInertia
from ident.records.record import Step

Steer = Callable[[Path, int], list[str]]


def frames_of(run: Run) -> list[str]:
    """Lines of candump: time, identifier and data."""
    logs = [path.read_text() for _, path in finished_steps(run.folder.frames)]
    return [line for log in logs for line in log.splitlines() if line.startswith("(")]


@pytest.fixture(scope="module")
def steer(drive: Callable[..., Run]) -> Steer:
    def run(folder: Path, seed: int) -> list[str]:
        given = {"known_inertia": KnownInertia(0.121, 0.001, "given"), "periods": 2}
        return frames_of(drive(folder, [Step.ROTATION], seed=seed, log_format=LogFormat.CANDUMP, **given))

    return run


@pytest.fixture(scope="module")
def first(steer: Steer, tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    return steer(tmp_path_factory.mktemp("repeated") / "first", 5)


def test_two_runs_with_one_seed_give_identical_frames(first: list[str], steer: Steer, tmp_path: Path) -> None:
    assert len(first) > 100_000
    assert first == steer(tmp_path / "second", 5)


def test_another_seed_gives_another_campaign(first: list[str], steer: Steer, tmp_path: Path) -> None:
    assert first != steer(tmp_path / "second", 6)

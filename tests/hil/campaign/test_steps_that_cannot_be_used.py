"""What cannot be used is said while the vehicle still stands there, is driven again, and its log is kept."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import can
import numpy as np
import pytest

from hil.bench import emulation
from hil.bus.clock import Clock
from hil.campaign.folder import Run, RunFolder
from hil.campaign.inspection import reject_unusable
from hil.campaign.reading import read_driven
from hil.campaign.runner import CampaignRunner
from hil.frames.recorder import Recorder, finished_steps
from hil.network import load_network
from ident.campaign.excitation import FourierSeries
from ident.campaign.optimise import Excitation
from ident.campaign.plan import assemble_plan
from ident.campaign.steps import DIAGNOSTIC, EXCITATIONS
from ident.errors import CampaignError
from ident.records.record import Step
from ident.vehicle.description import load_vehicle


class LosingRecorder(Recorder):
    """Its computer was busy for a moment, and a frame never came to it."""

    lost = iter(range(10**9))

    def __call__(self, message: can.Message) -> None:
        if message.arbitration_id != 0x183 or next(self.lost) != 700:
            super().__call__(message)


@pytest.fixture
def run(tmp_path: Path) -> Run:
    """One short step with the wheels in the air, before which nothing has to be aligned."""
    spec = replace(EXCITATIONS[Step.WHEEL_LIFTED], period=1.0)
    excitation = Excitation(FourierSeries(np.array([0.0]), np.array([0.5]), 1.0), 1.0, "")
    network = load_network()
    plan = assemble_plan(
        load_vehicle(),
        {Step.WHEEL_LIFTED: excitation},
        steps=[Step.WHEEL_LIFTED],
        periods=4,
        cycle=network.cycle_period,
        specs={**DIAGNOSTIC, Step.WHEEL_LIFTED: spec},
    )
    return Run(RunFolder(tmp_path / "run"), plan, network, 1, "emulator", "prototype", None)


Progress = Callable[[Clock, int], None]


def drive(run: Run, recorder: Recorder, progress: Progress = lambda *_: None) -> None:
    with emulation.bench("prototype", 1, False, run.network.path) as bench:
        clock = bench.clock
        try:
            CampaignRunner(
                run, bench.bus, clock, recorder, bench.operator, lambda _step, done, _total: progress(clock, done)
            ).drive()
        finally:
            recorder.close()


def names(run: Run) -> list[str]:
    return sorted(path.name for path in run.folder.frames.iterdir() if "interlude" not in path.name)


def test_a_log_with_a_lost_frame_is_said_and_kept_and_the_step_driven_again(run: Run) -> None:
    with pytest.raises(CampaignError) as caught:
        drive(run, LosingRecorder(run.folder.frames))
    assert "wheel_lifted cannot be used" in caught.value.what
    assert "node 3 (drive_fr) has no sample in 1 of 3000 cycles" in caught.value.what
    assert "--resume" in caught.value.remedy
    assert names(run) == ["001_wheel_lifted.unusable.blf"]
    kept = (run.folder.frames / "001_wheel_lifted.unusable.blf").read_bytes()

    drive(run, Recorder(run.folder.frames))

    assert [step for step, _ in finished_steps(run.folder.frames)] == [Step.WHEEL_LIFTED]
    assert (run.folder.frames / "001_wheel_lifted.unusable.blf").read_bytes() == kept
    assert read_driven(run).steps == [Step.WHEEL_LIFTED]


def test_more_cycles_left_out_than_can_be_interpolated_are_said_at_once(run: Run) -> None:
    def away(clock: Clock, done: int) -> None:
        if done == 1000:
            clock.wait_until(clock.now() + 0.021)

    with pytest.raises(CampaignError, match=r"the master left out \d+ cycles in a row") as caught:
        drive(run, Recorder(run.folder.frames), away)
    assert "--resume" in caught.value.remedy
    assert finished_steps(run.folder.frames) == []
    assert names(run) == ["001_wheel_lifted.part.blf"]


def test_as_many_as_can_be_interpolated_are_no_reason_to_drive_again(run: Run) -> None:
    def away(clock: Clock, done: int) -> None:
        if done == 1000:
            clock.wait_until(clock.now() + 0.0115)

    drive(run, Recorder(run.folder.frames), away)
    (segment,) = read_driven(run).of(Step.WHEEL_LIFTED)
    assert 3003 <= len(segment) <= 3006


def _cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-5000])


def _shortened(path: Path) -> None:
    """A whole log of half a step, as after a copy by a tool that sorts by time."""
    with can.BLFReader(path) as reader:
        messages = list(reader)
    with can.BLFWriter(path) as writer:
        for message in messages[: len(messages) // 2]:
            writer.on_message_received(message)


def _emptied(path: Path) -> None:
    path.write_bytes(b"")


@pytest.mark.parametrize(
    ("damage", "words"), [(_cut, "truncated"), (_shortened, "was planned with 3000"), (_emptied, "001_wheel_lifted")]
)
def test_a_log_that_was_damaged_since_is_found_and_kept(run: Run, damage: Callable[[Path], None], words: str) -> None:
    drive(run, Recorder(run.folder.frames))
    ((step, path),) = finished_steps(run.folder.frames)
    damage(path)
    damaged = path.read_bytes()
    (rejected,) = reject_unusable(run, [(step, path)])
    assert words in rejected.error.what
    assert rejected.log.read_bytes() == damaged
    assert finished_steps(run.folder.frames) == []

"""When hands are asked for: the wheels are lifted and lowered, and a resumed run never assumes where it stands."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from hil.bench import emulation
from hil.campaign.folder import Run
from hil.campaign.runner import CampaignRunner
from hil.frames.recorder import Recorder, finished_steps
from ident.records.record import Step


@dataclass
class Hands:
    """Does what it is asked, and remembers it."""

    operator: emulation.BenchOperator
    asked: list[str] = field(default_factory=list)
    seen: list[str] = field(default_factory=list)

    def watch(self, step: str, done: int, total: int) -> None:
        if done == total:
            self.seen.append(step)

    def lift(self) -> None:
        self.asked.append("lift")
        self.operator.lift()

    def lower(self) -> None:
        self.asked.append("lower")
        self.operator.lower()


def drive(plan_run: Callable[..., Run], folder: Path, already: list[Step]) -> Hands:
    steps = [Step.WHEEL_LIFTED, Step.ROTATION]
    run = plan_run(folder, steps, periods=1)
    run.folder.frames.mkdir()
    for number, step in enumerate(already):
        (run.folder.frames / f"{number:03d}_{step}.blf").write_bytes(b"")
    with emulation.bench(run.prototype, run.seed, False, run.network.path) as bench:
        hands = Hands(bench.operator)
        recorder = Recorder(run.folder.frames)
        CampaignRunner(run, bench.bus, bench.clock, recorder, hands, hands.watch).drive()
        recorder.close()
    assert {step for step, _ in finished_steps(run.folder.frames)} >= set(steps)
    return hands


def test_the_vehicle_is_lifted_and_lowered_once(plan_run: Callable[..., Run], tmp_path: Path) -> None:
    hands = drive(plan_run, tmp_path / "run", [])
    assert hands.asked == ["lift", "lower"]
    # Whoever watches sees which attempt at an alignment it is, before the step that it is for.
    lifted, first, *_, rotation = hands.seen
    assert (lifted, rotation) == ("wheel_lifted", "rotation")
    assert first == "aligning for rotation, attempt 1 of 12"


def test_a_run_that_was_killed_on_the_stand_asks_for_the_floor(plan_run: Callable[..., Run], tmp_path: Path) -> None:
    assert drive(plan_run, tmp_path / "run", [Step.WHEEL_LIFTED]).asked == ["lower"]

"""When hands are asked for: the wheels are lifted and lowered, and a resumed run never assumes where it stands."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hil import emulation
from hil.campaign.folder import Run, RunFolder, create_run, network_file_of
from hil.campaign.runner import CampaignRunner
from hil.network import load_network
from hil.recorder import Recorder, finished_steps
from ident.campaign.plan import make_plan
from ident.records.record import Step
from ident.vehicle.description import find_data_file, load_vehicle


@dataclass
class Hands:
    """Does what it is asked, and remembers it."""

    operator: emulation.BenchOperator
    asked: list[str] = field(default_factory=list)

    def lift(self) -> None:
        self.asked.append("lift")
        self.operator.lift()

    def lower(self) -> None:
        self.asked.append("lower")
        self.operator.lower()


def drive(folder: Path, already: list[Step]) -> Hands:
    steps = [Step.WHEEL_LIFTED, Step.ROTATION]
    network_file = network_file_of("prototype")
    network = load_network(network_file)
    generator = np.random.default_rng(1)
    plan = make_plan(load_vehicle(), generator, steps=steps, periods=4, cycle=network.cycle_period)
    run = Run(RunFolder(folder), plan, network, 1, "emulator, in lockstep", "prototype", None)
    create_run(run, find_data_file("ident.vehicle", "prototype"))
    run.folder.frames.mkdir()
    for number, step in enumerate(already):
        (run.folder.frames / f"{number:03d}_{step}.blf").write_bytes(b"")
    with emulation.bench("prototype", 1, False, network_file) as bench:
        hands = Hands(bench.operator)
        recorder = Recorder(run.folder.frames)
        CampaignRunner(run, bench.bus, bench.clock, recorder, hands, lambda *_: None).drive()
        recorder.close()
    assert {step for step, _ in finished_steps(run.folder.frames)} >= set(steps)
    return hands


def test_the_vehicle_is_lifted_and_lowered_once(tmp_path: Path) -> None:
    assert drive(tmp_path / "run", []).asked == ["lift", "lower"]


def test_a_run_that_was_killed_on_the_stand_asks_for_the_floor(tmp_path: Path) -> None:
    assert drive(tmp_path / "run", [Step.WHEEL_LIFTED]).asked == ["lower"]

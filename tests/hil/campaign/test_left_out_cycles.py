"""A master short of time leaves cycles out; its run is read all the same, and its repeats stay in phase."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from emulator.firmware.flywheels import Flywheels
from hil.bench import emulation
from hil.bench.lockstep import LockstepBench
from hil.bench.truth import truth_of
from hil.campaign.creating import create_run
from hil.campaign.folder import Run, RunFolder
from hil.campaign.reading import read_driven, read_run
from hil.campaign.runner import CampaignRunner
from hil.frames.recorder import Recorder
from hil.master import Master
from hil.network import load_network, network_file_of
from ident.campaign.excitation import FourierSeries
from ident.campaign.optimise import Excitation
from ident.campaign.plan import assemble_plan, make_plan
from ident.campaign.steps import DIAGNOSTIC, EXCITATIONS
from ident.estimate.identify import identify
from ident.estimate.result import KnownInertia
from ident.records.record import Segment, Step
from ident.records.repeats import repeats_of
from ident.vehicle.description import find_data_file, load_vehicle

PERIOD = 0.5
SLOPE = 0.3 * 2 * math.pi / 250
"""Largest change of the torque from cycle to cycle [Nm]."""


def short_run(folder: Path) -> Run:
    """A run of one short step, which flywheels can turn."""
    spec = replace(EXCITATIONS[Step.STRAIGHT], period=PERIOD)
    excitation = Excitation(FourierSeries(np.array([0.0]), np.array([0.05]), PERIOD), 1.0, "")
    network = load_network()
    plan = assemble_plan(
        load_vehicle(),
        {Step.STRAIGHT: excitation},
        steps=[Step.STRAIGHT],
        periods=4,
        cycle=network.cycle_period,
        specs={**DIAGNOSTIC, Step.STRAIGHT: spec},
    )
    return Run(RunFolder(folder), plan, network, 1, "flywheels", "", None)


def drive(run: Run, late: Mapping[int, float]) -> None:
    """A sine of torque a repeat, the computer being away for some time [s] before some cycles."""
    repeats = run.plan.repeats(Step.STRAIGHT)
    first = int(np.argmax(repeats >= 0))
    recorder = Recorder(run.folder.frames)
    with LockstepBench(Flywheels()) as bench, Master(bench.bus, bench.clock, run.network, recorder) as master:
        master.boot()
        master.enable()
        with recorder.step(Step.STRAIGHT):
            for cycle, repeat in enumerate(repeats):
                bench.clock.wait_until(bench.clock.now() + late.get(cycle, 0.0))
                torque = 0.3 * math.sin(2 * math.pi * (cycle - first) / 250) if repeat >= 0 else 0.0
                master.exchange([torque] * 4)
    recorder.close()


def driven(folder: Path, late: Mapping[int, float]) -> Segment:
    run = short_run(folder)
    drive(run, late)
    (segment,) = read_driven(run).of(Step.STRAIGHT)
    return segment


LATE = {600: 0.0073, 815: 0.0043, 1204: 0.0113, 1230: 0.0031}
"""Cycles of the first, second and third repeat before which the computer is away; the last one is no cycle long."""


def test_a_run_with_left_out_cycles_is_read_from_its_folder(tmp_path: Path) -> None:
    on_time, late = driven(tmp_path / "on time", {}), driven(tmp_path / "late", LATE)
    assert len(late) > len(on_time)
    for segment in (on_time, late):
        assert [int(np.sum(segment.period == number)) for number in range(4)] == [250] * 4


def test_the_same_phase_of_every_repeat_was_driven_by_the_same_torque(tmp_path: Path) -> None:
    """Counted by rows, what follows a gap would be up to five cycles off its fellows in the other repeats."""
    segment = driven(tmp_path, LATE)
    phases = segment.command_torques[repeats_of(segment.period)]
    spread = np.ptp(phases, axis=0).max()
    assert spread < 1.6 * SLOPE, "a stamp is exact to less than a cycle"
    by_rows = np.concatenate([segment.period[segment.period < 0][:500], np.repeat(np.arange(4), 250)])
    assert np.ptp(segment.command_torques[: len(by_rows)][repeats_of(by_rows)], axis=0).max() > 4 * SLOPE


def test_rows_between_two_cycles_that_are_not_neighbours_belong_to_no_repeat(tmp_path: Path) -> None:
    segment = driven(tmp_path, LATE)
    inside = slice(int(np.argmax(segment.period >= 0)), -int(np.argmax(segment.period[::-1] >= 0)))
    assert np.sum(segment.period[inside] < 0) == len(segment) - 2000 > 8


@pytest.mark.slow
def test_a_campaign_with_left_out_cycles_ends_in_the_parameters(tmp_path: Path) -> None:
    """A tenth of the hundreds of cycles with a stumble of one to five cycles each, over CAN, in the physics engine."""
    generator = np.random.default_rng(3)
    steps = (Step.STEERING_LEFT, Step.STEERING_RIGHT, Step.STRAIGHT, Step.ROTATION)
    network = load_network(network_file_of("prototype"))
    plan = make_plan(load_vehicle(), np.random.default_rng(1), steps=steps, periods=4, cycle=network.cycle_period)
    inertia = KnownInertia(truth_of("prototype")["B_w"], 1e-4, "given")
    run = Run(RunFolder(tmp_path / "run"), plan, network, 1, "emulator", "prototype", inertia)
    create_run(run, find_data_file("ident.vehicle", "prototype"))
    with emulation.bench("prototype", 1, False, network.path) as bench:
        clock = bench.clock

        def stumble(*_: object) -> None:
            if generator.random() < 0.1:
                clock.wait_until(clock.now() + float(generator.uniform(0.004, 0.0115)))

        recorder = Recorder(run.folder.frames)
        runner = CampaignRunner(run, bench.bus, clock, recorder, bench.operator, stumble)
        runner.drive()
        recorder.close()
    assert runner.overruns > 20
    record = read_run(run.folder.path)
    assert record.notes
    result = identify(record, plan.vehicle.geometry, known_inertia=inertia)
    truth = truth_of("prototype")
    for estimate in result.estimates:
        assert abs(estimate.value - truth[estimate.name]) < max(5 * estimate.std, 0.01 * truth[estimate.name])

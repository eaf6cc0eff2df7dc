"""The steps of a diagnosis, driven on the emulator over CAN: turned round, dithered, loaded."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from emulator.prototype import load_prototype
from emulator.vehicle import EmulatedVehicle
from hil.bench.emulation import BenchOperator
from hil.bench.lockstep import LockstepBench
from hil.campaign.creating import create_run
from hil.campaign.folder import Run, RunFolder, open_run
from hil.campaign.reading import PAYLOAD, read_driven
from hil.campaign.runner import CampaignRunner
from hil.frames.recorder import Recorder
from hil.network import load_network, network_file_of
from ident.campaign.plan import make_plan
from ident.campaign.steps import PERIODS
from ident.estimate.equations import equations_of
from ident.estimate.filters import Processing
from ident.records.record import Record, Segment, Step
from ident.vehicle.description import find_data_file, load_vehicle

STEPS = (
    "straight",
    "straight_dither",
    "rotation",
    "rotation_turn",
    "straight_turned",
    "straight_loaded",
)
LOAD = 60.0


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    vehicle, network = load_vehicle("prototype"), load_network(network_file_of("prototype"))
    plan = make_plan(vehicle, np.random.default_rng(3), steps=STEPS, periods=PERIODS, cycle=network.cycle_period)
    folder = RunFolder(tmp_path_factory.mktemp("diagnostic") / "run")
    planned = Run(folder, plan, network, 3, "test", "prototype", None, LOAD)
    create_run(planned, find_data_file("ident.vehicle", "prototype"))
    driven = replace(planned, plan=replace(plan, periods=1))
    recorder = Recorder(folder.frames)
    with (
        EmulatedVehicle(load_prototype(), seed=3, noise_scale=0.0) as emulated,
        LockstepBench(emulated, network.path) as bench,
    ):
        CampaignRunner(
            driven, bench.bus, bench.clock, recorder, BenchOperator(emulated), lambda *_: None, spare_alignments=True
        ).drive()
        recorder.close()
        assert abs(emulated.ground_truth().pose[2]) < 0.05, "the loaded vehicle stands where it was lowered"
    return driven


@pytest.fixture(scope="module")
def record(run: Run) -> Record:
    return read_driven(run)


def segment(record: Record, step: str) -> Segment:
    return next(record.of(step))


@pytest.mark.slow
def test_every_step_has_its_own_log_under_its_own_name(record: Record) -> None:
    assert [step for step in record.steps if step != Step.ALIGNMENT] == list(STEPS)


@pytest.mark.slow
def test_the_dither_moves_nothing_and_tells_the_drives_apart(record: Record) -> None:
    plain, dithered = segment(record, "straight"), segment(record, "straight_dither")
    shared = min(len(plain), len(dithered))
    assert np.abs(plain.wheel_angles[:shared] - dithered.wheel_angles[:shared]).max() < 0.05
    assert np.abs(dithered.steering_angles).max() < 0.01
    condition = [np.linalg.cond(each.motor_torques) for each in (plain, dithered)]
    assert condition[1] < condition[0] / 5


@pytest.mark.slow
def test_the_vehicle_is_turned_half_round(record: Record, run: Run) -> None:
    turn = segment(record, "rotation_turn")
    geometry = run.plan.vehicle.geometry
    lever = np.hypot(geometry.wheelbase, geometry.track_width) / 2 + geometry.wheel_offset
    turned = np.abs(turn.wheel_angles[-1] - turn.wheel_angles[0]) * geometry.wheel_radius / lever
    assert turned == pytest.approx(np.pi, rel=0.01)


@pytest.mark.slow
def test_the_load_is_felt_and_noted(record: Record, run: Run) -> None:
    """Newton: the difference in force over the difference in mass is the acceleration."""
    loaded, plain = segment(record, "straight_loaded"), segment(record, "straight")
    assert loaded.extra[PAYLOAD] == pytest.approx(LOAD)
    geometry, truth = run.plan.vehicle.geometry, load_prototype().truth
    masses = []
    for each in (plain, loaded):
        rows = equations_of(replace(each, step="straight"), geometry, Processing())[0]
        known = np.delete(np.arange(11), 6)
        left = rows.torque - rows.regressor[:, known] @ truth.values[known]
        columns = rows.regressor[rows.moving, 6]
        masses.append(float(columns @ left[rows.moving] / (columns @ columns)))
    assert masses[1] - masses[0] == pytest.approx(LOAD, rel=0.02)


@pytest.mark.slow
def test_the_folder_remembers_steps_and_load(run: Run) -> None:
    opened = open_run(run.folder.path)
    assert opened.payload == LOAD
    assert opened.plan.steps == run.plan.steps == STEPS
    assert set(opened.plan.excitations) == {"straight", "rotation"}

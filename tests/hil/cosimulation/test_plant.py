"""An FMU as the vehicle behind the connector, and a record's torques through it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from emulator.prototype import load_prototype
from fmu.compiling import find_compiler
from fmu.description import FmiVersion
from fmu.packaging import Order, build_fmu
from fmu.platforms import host_platform
from fmu.source import ModelSource
from fmu.variables import Inputs
from hil.bench.lockstep import LockstepBench
from hil.campaign.creating import create_run
from hil.campaign.folder import Run, RunFolder
from hil.campaign.reading import read_run
from hil.campaign.runner import CampaignRunner
from hil.cosimulation.instance import FmuError, FmuInstance
from hil.cosimulation.plant import FmuVehicle, plant_path
from hil.cosimulation.replay import replay, simulate, write_plot
from hil.frames.recorder import Recorder
from hil.master import Master
from hil.network import load_network
from ident.campaign.plan import make_plan
from ident.errors import UserError
from ident.estimate.equations import ROWS
from ident.estimate.identify import identify
from ident.records.record import Record, Segment, Step, make_segment
from ident.vehicle.description import find_data_file, load_vehicle
from ident.vehicle.parameters import PARAMETER_NAMES

STEP = 2e-3


@pytest.fixture(scope="module")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> dict[tuple[FmiVersion, Inputs], Path]:
    """Both versions with torque inputs, and one with speed inputs."""
    vehicle = load_vehicle()
    source = ModelSource(vehicle, vehicle.prior, (), {}, {})
    folder, made = tmp_path_factory.mktemp("plants"), {}
    for version, inputs in [*((version, Inputs.TORQUE) for version in FmiVersion), (FmiVersion.FMI2, Inputs.SPEED)]:
        path = folder / f"{inputs}{version}.fmu"
        path.write_bytes(build_fmu(source, Order(version, inputs, (host_platform(),)), find_compiler()))
        made[version, inputs] = path
    return made


@pytest.fixture(scope="module")
def fmu(fmus: dict[tuple[FmiVersion, Inputs], Path]) -> Path:
    return fmus[FmiVersion.FMI2, Inputs.TORQUE]


@pytest.fixture
def vehicle(fmu: Path) -> Iterator[FmuVehicle]:
    with FmuVehicle(fmu, load_prototype(), seed=1) as opened:
        yield opened


def drive_all(vehicle: FmuVehicle, torque: float, seconds: float) -> None:
    for drive, direction in zip(vehicle.drives, load_prototype().drive.directions, strict=True):
        drive.enable()
        drive.command(torque * direction)
    vehicle.advance(seconds)


def test_a_master_boots_it_and_drives_it_as_any_other_vehicle(vehicle: FmuVehicle) -> None:
    with LockstepBench(vehicle) as bench, Master(bench.bus, bench.clock, load_network()) as master:
        master.boot()
        master.enable()
        first = master.exchange((0.0,) * 4)
        for _ in range(250):
            sample = master.exchange((0.6,) * 4)
    turned = np.array(sample.wheel_angles) - first.wheel_angles
    assert np.all(turned > 0.02)
    assert np.ptp(turned) < 0.02 * np.mean(turned)
    assert sample.motor_torques == pytest.approx((0.6,) * 4, abs=0.03)


def test_on_the_jack_stand_the_wheels_turn_and_the_vehicle_stays(vehicle: FmuVehicle) -> None:
    """B_w dω/dt = i_G u - d_cw - d_vw ω: far quicker than with 840 kg to move."""
    pose = vehicle.instance.port(["pose_x", "pose_y", "gamma", "alpha_l"])
    vehicle.lift()
    drive_all(vehicle, 0.6, 1.0)
    parameters = load_vehicle().prior
    balance = (0.6 * 20 - parameters["d_cw"]) / parameters["d_vw"]
    rate = parameters["d_vw"] / parameters["B_w"]
    for drive in vehicle.drives:
        assert abs(drive.velocity()) / 20 == pytest.approx(balance * (1 - np.exp(-rate)), rel=0.05)
    # The solver's absolute tolerance: a micrometre an internal step.
    assert vehicle.instance.read(pose) == pytest.approx([0.0] * 4, abs=1e-4)
    vehicle.lower()
    drive_all(vehicle, -0.6, 0.2)
    assert vehicle.instance.read(pose)[0] > 1e-3


def test_a_wheel_on_ice_spins(vehicle: FmuVehicle) -> None:
    vehicle.wet(0, 0.005)
    drive_all(vehicle, 0.9, 0.5)
    speeds = [abs(drive.velocity()) for drive in vehicle.drives]
    assert speeds[0] > 5 * max(speeds[1:])
    vehicle.dry(0)
    vehicle.advance(0.5)
    speeds = [abs(drive.velocity()) for drive in vehicle.drives]
    assert speeds[0] == pytest.approx(speeds[2], rel=0.05)


def test_a_load_slows_it_down_by_its_mass(fmu: Path) -> None:
    """Speeds after the same push: (1 - exp(-t D/M)) / (1 - exp(-t D/M')), M with the wheels' inertia, D = 4 d_vw/r²."""
    parameters, seconds = load_vehicle().prior, 0.4

    def speed(load: float) -> float:
        with FmuVehicle(fmu, load_prototype(), seed=1) as vehicle:
            vehicle.load(load)
            drive_all(vehicle, 1.2, seconds)
            return float(vehicle.instance.read(vehicle.instance.port(["x_dot"]))[0])

    inertia, drag = parameters["m_ch"] + 4 * parameters["B_w"] / 0.1**2, 4 * parameters["d_vw"] / 0.1**2
    light, heavy = (1 - np.exp(-seconds * drag / mass) for mass in (inertia, inertia + 800.0))
    assert speed(0.0) / speed(800.0) == pytest.approx(light / heavy, rel=2e-3)


def test_equal_seeds_give_equal_readings(fmu: Path) -> None:
    readings = []
    for _ in range(2):
        with FmuVehicle(fmu, load_prototype(), seed=7) as vehicle:
            drive_all(vehicle, 0.7, 0.1)
            readings.append([drive.position() for drive in vehicle.drives] + [vehicle.drives[0].measured_torque()])
    assert readings[0] == readings[1]


def test_a_plant_that_cannot_be_is_refused_with_a_remedy(
    fmus: dict[tuple[FmiVersion, Inputs], Path], tmp_path: Path
) -> None:
    with pytest.raises(FmuError, match="no plant"):
        plant_path("pybullet")
    with pytest.raises(FmuError, match="torque_fl"):
        FmuVehicle(fmus[FmiVersion.FMI2, Inputs.SPEED], load_prototype(), seed=1)
    with pytest.raises(FmuError, match="cannot be read"):
        FmuInstance(tmp_path / "missing.fmu", {})
    with pytest.raises(FmuError, match="m_ch"):
        FmuInstance(fmus[FmiVersion.FMI2, Inputs.TORQUE], {"m_ch": -1.0})


def segment_of(step: str, torque: float, still: tuple[float, float] = (0.0, 0.0)) -> Segment:
    """Three seconds of a torque that swings, on all wheels alike; angles that stand still."""
    count = 1500
    time = np.arange(count) * STEP
    torques = torque * np.sin(2 * np.pi * time / 1.5)[:, None] * np.ones(4)
    raw = Segment(
        step, STEP, time, torques, np.zeros((count, 4)), np.tile(still, (count, 1)), np.full(count, -1, dtype=np.int64)
    )
    return make_segment(raw, "made")


@pytest.mark.parametrize("version", list(FmiVersion))
def test_what_an_fmu_has_driven_it_drives_again(
    fmus: dict[tuple[FmiVersion, Inputs], Path], version: FmiVersion, tmp_path: Path
) -> None:
    """A record made by the FMU itself has no outcome gap."""
    fmu, geometry = fmus[version, Inputs.TORQUE], load_vehicle().geometry
    segment = segment_of("straight", 1.6)
    driven = simulate(fmu, segment, ROWS[Step.STRAIGHT], geometry)
    assert np.ptp(driven.wheel_angles) > 0.1
    outcomes = list(replay(fmu, Record([driven], "made"), geometry))
    assert [outcome.coordinate for outcome in outcomes] == ["x"]
    assert outcomes[0].nrmse < 1e-9
    write_plot(outcomes, tmp_path / "plot.html")
    assert "recorded" in (tmp_path / "plot.html").read_text()


def test_a_heavier_vehicle_shows_in_the_outcome(fmu: Path) -> None:
    geometry = load_vehicle().geometry
    driven = simulate(fmu, segment_of("straight", 1.6), ROWS[Step.STRAIGHT], geometry)
    slow = Segment(
        driven.step,
        STEP,
        driven.time,
        driven.motor_torques,
        0.8 * driven.wheel_angles,
        driven.steering_angles,
        driven.period,
    )
    (outcome,) = replay(fmu, Record([slow], "made"), geometry)
    assert outcome.nrmse == pytest.approx(0.25, rel=1e-3)


def test_a_record_without_driven_steps_is_refused(fmu: Path) -> None:
    record = Record([segment_of("parking", 1.0)], "made")
    with pytest.raises(UserError, match="no step to replay"):
        list(replay(fmu, record, load_vehicle().geometry))


@pytest.mark.slow
def test_a_campaign_over_can_on_the_fmu_finds_the_fmu_s_parameters_sample(fmu: Path, tmp_path: Path) -> None:
    """The same master, controller and estimator as on the physics engine; every parameter to half a per cent."""
    steps = (Step.WHEEL_LIFTED, Step.STEERING_LEFT, Step.STEERING_RIGHT, Step.STRAIGHT, Step.ROTATION)
    network = load_network()
    described = load_vehicle()
    plan = make_plan(described, np.random.default_rng(1), steps=steps, periods=4, cycle=network.cycle_period)
    run = Run(RunFolder(tmp_path / "run"), plan, network, 1, f"fmu:{fmu}", "", None)
    create_run(run, find_data_file("ident.vehicle", "prototype"))
    with FmuVehicle(fmu, load_prototype(), seed=1) as vehicle, LockstepBench(vehicle) as bench:
        recorder = Recorder(run.folder.frames)
        CampaignRunner(run, bench.bus, bench.clock, recorder, vehicle, lambda *_: None).drive()
        recorder.close()
    result = identify(read_run(run.folder.path), described.geometry)
    errors = {one.name: one.value / described.prior[one.name] - 1 for one in result.estimates}
    assert errors.keys() == set(PARAMETER_NAMES)
    assert max(abs(error) for error in errors.values()) < 5e-3, errors

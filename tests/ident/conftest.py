"""Vehicles for all tests of `ident`: a campaign that the model fits, and records that share no code with the model."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import pytest
from numpy.typing import NDArray

from hil.exam.sources.courses import two_records
from hil.exam.sources.independent import LuGre, Truth
from ident.campaign.axis import axis_of
from ident.campaign.excitation import resting_projection, series_of
from ident.campaign.optimise import Excitation, Problem, size_within_limits
from ident.campaign.plan import Plan, assemble_plan
from ident.campaign.reference import STEERING_LOOPS, Reference
from ident.campaign.steps import EXCITATIONS
from ident.estimate.filters import Processing
from ident.estimate.identify import identify
from ident.estimate.result import Identification
from ident.plant import dynamics, kinematics
from ident.plant.kinematics import virtual_steering
from ident.plant.modes import Mode
from ident.records.record import Record, Segment, Step, make_segment
from ident.report.paper import load_paper_result
from ident.vehicle.description import VehicleDescription, load_vehicle
from ident.vehicle.geometry import Geometry
from ident.vehicle.parameters import Parameters

Array = NDArray[np.float64]

Records = tuple[Record, Record]


@pytest.fixture(scope="session")
def prototype() -> VehicleDescription:
    return load_vehicle("prototype")


@pytest.fixture(scope="session")
def drives(prototype: VehicleDescription) -> Callable[..., Records]:
    """A record to fit and one to confirm, of other motions and noise."""

    def make(periods: int = 3, *, bristles: tuple[int, float, float] | None = None, compliance: float = 0.0) -> Records:
        truth = Truth(bristles=LuGre(*bristles) if bristles else None, compliance=compliance)
        return two_records(truth, prototype, np.random.default_rng(7), periods, length=4.0)

    return make


@pytest.fixture(scope="session")
def plain_truth() -> Mapping[str, float]:
    return Truth().parameters


@pytest.fixture(scope="session", params=["prototype", "compact"])
def vehicle(request: pytest.FixtureRequest) -> VehicleDescription:
    """Both shipped vehicles: their a/r differ, one above and one below 1."""
    return load_vehicle(request.param)


@pytest.fixture(scope="session")
def geometry(vehicle: VehicleDescription) -> Geometry:
    return vehicle.geometry


CAMPAIGN = (
    Step.WHEEL_LIFTED,
    Step.STEERING_LEFT,
    Step.STEERING_RIGHT,
    Step.STRAIGHT,
    Step.ROTATION,
    Step.LANE_CHANGE,
)
CYCLE = 0.004
TORQUE_NOISE = 0.01


def some_excitation(step: Step, vehicle: VehicleDescription) -> Excitation:
    spec = EXCITATIONS[step]
    axis = axis_of(spec, vehicle)
    shape = resting_projection(spec.harmonics) @ np.random.default_rng(7).normal(size=2 * spec.harmonics)
    series = series_of(shape, spec.period)
    motion = series.evaluate(np.linspace(0.0, spec.period, 400))
    problem = Problem(spec, axis, vehicle.limits, vehicle.geometry.gear_ratio, vehicle.prior["m_ch"], Processing())
    factor, binding = size_within_limits(motion, problem)
    return Excitation(series.scaled(factor), 5.0, binding)


def integral(rate: Array, cycle: float) -> Array:
    steps = (rate[1:] + rate[:-1]) * cycle / 2
    return np.concatenate([np.zeros((1, rate.shape[1])), np.cumsum(steps, axis=0)])


def wheel_angles(reference: Reference, plan: Plan, alpha: Array) -> Array:
    if reference.step is Step.WHEEL_LIFTED:
        return np.stack([track.position for name, track in reference.tracks.items() if name.startswith("beta")], axis=1)
    mode = Mode.STEERED if reference.step is Step.LANE_CHANGE else EXCITATIONS[reference.step].mode
    assert mode is not None
    rates = {name: track.velocity for name, track in reference.tracks.items()}
    if mode is Mode.STEERED:
        rates["alpha_v"] = np.gradient(virtual_steering(alpha, plan.vehicle.geometry), reference.sample_time)
    velocity = np.stack([rates[name] for name in kinematics.GENERALIZED_VELOCITIES[mode]], axis=1)
    lifted, _ = dynamics.lift_velocities(mode, alpha, velocity, np.zeros_like(velocity), plan.vehicle.geometry)
    return integral(lifted[:, 5:], reference.sample_time)


def driven(plan: Plan, step: Step, truth: Parameters, start: float, generator: np.random.Generator) -> Segment:
    reference = plan.reference(step, truth)
    count = len(reference)
    alpha = np.zeros((count, 2))
    for side, name in enumerate(STEERING_LOOPS):
        if name in reference.tracks:
            alpha[:, side] = reference.tracks[name].position
    noise = TORQUE_NOISE * generator.normal(size=(count, 4))
    time = start + plan.cycle * np.arange(count)
    beta = wheel_angles(reference, plan, alpha)
    return make_segment(
        Segment(step, 0.0, time, reference.feed_forward + noise, beta, alpha, reference.period), "simulated"
    )


@pytest.fixture(scope="session")
def truth() -> Parameters:
    return load_paper_result().parameters


@pytest.fixture(scope="session")
def plan(prototype: VehicleDescription) -> Plan:
    excitations = {step: some_excitation(step, prototype) for step in CAMPAIGN if step in EXCITATIONS}
    return assemble_plan(prototype, excitations, steps=CAMPAIGN, periods=4, cycle=CYCLE)


@pytest.fixture(scope="session")
def record(plan: Plan, truth: Parameters) -> Record:
    generator = np.random.default_rng(3)
    segments, start = [], 10.0
    for step in plan.steps:
        segments.append(driven(plan, step, truth, start, generator))
        start = float(segments[-1].time[-1]) + 0.5
    return Record(segments, "simulated")


@pytest.fixture(scope="session")
def identification(record: Record, prototype: VehicleDescription) -> Identification:
    return identify(record, prototype.geometry)

"""Records made by exact inverse dynamics: what a perfect vehicle with perfect sensors would write down."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.campaign.excitation import FourierSeries, resting_projection, series_of
from ident.plant import dynamics, kinematics
from ident.plant.modes import Mode
from ident.records.record import Record, Segment, Step, make_segment
from ident.vehicle.description import VehicleDescription
from ident.vehicle.geometry import Geometry
from ident.vehicle.parameters import Parameters

Array = NDArray[np.float64]

SAMPLE_TIME = 0.002
PERIOD = 4.0
HARMONICS = 5
# Mode, posture in units of (rotation angle or quarter turn), row of the generalized velocity, largest speed.
DRIVEN = {
    Step.STEERING_LEFT: (Mode.ALIGNMENT, 0, 3.0),
    Step.STEERING_RIGHT: (Mode.ALIGNMENT, 1, 3.0),
    Step.STRAIGHT: (Mode.STEERED, 1, 1.0),
    Step.ROTATION: (Mode.ROTATION, 0, 1.2),
    Step.LATERAL: (Mode.LATERAL, 0, 0.9),
}
FIT = (Step.STEERING_LEFT, Step.STEERING_RIGHT, Step.STRAIGHT, Step.ROTATION)
ALL = (Step.WHEEL_LIFTED, *FIT, Step.LATERAL)


def posture(mode: Mode, geometry: Geometry) -> Array:
    size = {Mode.LATERAL: np.pi / 2, Mode.ROTATION: geometry.rotation_angle}.get(mode, 0.0)
    return np.array([-size, size])


def random_series(generator: np.random.Generator, speed: float) -> FourierSeries:
    series = series_of(resting_projection(HARMONICS) @ generator.normal(size=2 * HARMONICS), PERIOD)
    velocity = series.evaluate(np.linspace(0, PERIOD, 400))[1]
    return series.scaled(speed / float(np.abs(velocity).max()))


def driven_segment(
    step: Step, series: FourierSeries, vehicle: VehicleDescription, truth: Parameters, periods: int
) -> Segment:
    """One step without noise: angles by exact integration, torques by (21) or, in the air, by (16)."""
    per_period = round(PERIOD / SAMPLE_TIME)
    time = SAMPLE_TIME * np.arange(periods * per_period)
    position, velocity, acceleration = series.evaluate(time)
    if step is Step.WHEEL_LIFTED:
        alpha, beta, torques = lifted(position, velocity, acceleration, vehicle.geometry, truth)
    else:
        alpha, beta, torques = on_the_floor(step, (position, velocity, acceleration), vehicle.geometry, truth)
    period = np.repeat(np.arange(periods), per_period)
    return make_segment(Segment(step, 0.0, time, torques, beta, alpha, period), "synthetic")


def lifted(
    position: Array, velocity: Array, acceleration: Array, geometry: Geometry, truth: Parameters
) -> tuple[Array, Array, Array]:
    rates, accelerations = np.zeros((2, len(position), 9))
    rates[:, 5:], accelerations[:, 5:] = velocity[:, None], acceleration[:, None]
    torques = (dynamics.regressor(rates, accelerations) @ truth.values)[:, 5:] / geometry.gear_ratio
    return np.zeros((len(position), 2)), np.tile(position[:, None], 4), torques


def on_the_floor(
    step: Step, motion: tuple[Array, Array, Array], geometry: Geometry, truth: Parameters
) -> tuple[Array, Array, Array]:
    mode, row, _ = DRIVEN[step]
    position, velocity, acceleration = motion
    width = len(kinematics.GENERALIZED_VELOCITIES[mode])
    alpha = np.tile(posture(mode, geometry), (len(position), 1))
    column = kinematics.complement(mode, alpha[:1], geometry)[0, 5:, row]  # constant in all of these steps
    velocities, accelerations = np.zeros((2, len(position), width))
    velocities[:, row], accelerations[:, row] = velocity, acceleration
    if mode is Mode.ALIGNMENT:
        alpha[:, row] += position
    torques = dynamics.feed_forward(mode, alpha, velocities, accelerations, truth.values, geometry)
    return alpha, position[:, None] * column, torques


def make_record(
    vehicle: VehicleDescription,
    truth: Parameters,
    steps: Iterable[Step] = ALL,
    *,
    periods: int = 3,
    seed: int = 0,
    speed: float = 1.0,
) -> Record:
    """A record of several steps; `speed` scales all motions."""
    generator = np.random.default_rng(seed)
    largest = {step: 10.0 if step is Step.WHEEL_LIFTED else DRIVEN[step][2] for step in ALL}
    motions = {step: random_series(generator, speed * largest[step]) for step in ALL}
    return Record([driven_segment(step, motions[step], vehicle, truth, periods) for step in steps], "synthetic")


@pytest.fixture(scope="session")
def record_of() -> Callable[..., Record]:
    return make_record


@pytest.fixture(scope="session")
def truth(vehicle: VehicleDescription) -> Parameters:
    """Away from the prior, and different left and right."""
    factors = np.array([0.8, 1.3, 0.9, 1.2, 0.7, 1.1, 1.05, 1.06, 1.2, 1.1, 1.01])
    return Parameters(vehicle.prior.values * factors, np.zeros(len(factors)))

"""References: what every loop shall follow, sample by sample, with the feed-forward torques of (21)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.campaign.excitation import FourierSeries
from ident.campaign.steps import StepSpec
from ident.plant import dynamics, kinematics
from ident.plant.modes import Mode
from ident.records.record import Step
from ident.vehicle.description import VehicleDescription
from ident.vehicle.geometry import WHEELS, Geometry
from ident.vehicle.parameters import Parameters

Array = NDArray[np.float64]

SETTLING: Final = 1.0
"""Standstill before and after every motion [s]."""

TURN_SPEED: Final = 0.5
"""Mean rate at which a vehicle is turned round [rad/s]."""

LIFTED_LOOPS: Final = tuple(f"beta_{wheel}" for wheel in WHEELS)
STEERING_LOOPS: Final = ("alpha_l", "alpha_r")


@dataclass(frozen=True)
class Track:
    """What one loop follows.

    Attributes:
        position, velocity: (N,) of its coordinate.
        wheels: (N, 4) wheel rates per rate of the coordinate, the coordinate's column of H_k.
    """

    position: Array
    velocity: Array
    wheels: Array


@dataclass(frozen=True)
class Reference:
    """A step ready to be driven.

    Attributes:
        step: its name in records.
        coordinate: what is driven.
        sample_time: [s].
        tracks: by coordinate: alpha_l, alpha_r, and x, y or gamma; or beta_fl ... in the air.
        feed_forward: motor torques (N, 4) [Nm].
        period: (N,) number of the repeat, -1 outside of any.
        path: (N, 3) pose that the chassis is to take, from the start of the step [m, m, rad].
    """

    step: str
    coordinate: str
    sample_time: float
    tracks: Mapping[str, Track]
    feed_forward: Array
    period: NDArray[np.int64]
    path: Array = field(repr=False)

    def __len__(self) -> int:
        return len(self.feed_forward)

    @property
    def duration(self) -> float:
        """[s]."""
        return len(self) * self.sample_time


def excitation_reference(
    spec: StepSpec,
    series: FourierSeries,
    periods: int,
    vehicle: VehicleDescription,
    parameters: Parameters,
    sample_time: float,
) -> Reference:
    """An excitation step: standstill, `periods` repeats, standstill."""
    per_period = round(spec.period / sample_time)
    motion = series.evaluate(sample_times(per_period, sample_time))
    rest = round(SETTLING / sample_time)
    position, velocity, acceleration = (_padded(np.tile(values, periods), rest) for values in motion)
    period = repeats_of(spec, periods, sample_time)
    return _single_motion(spec, (position, velocity, acceleration), period, vehicle, parameters, sample_time)


def repeats_of(spec: StepSpec, periods: int, sample_time: float) -> NDArray[np.int64]:
    """Number of the repeat of every sample of an excitation step, -1 at the standstill before and behind."""
    rest, repeats = np.full(round(SETTLING / sample_time), -1), np.arange(periods)
    return np.concatenate([rest, np.repeat(repeats, round(spec.period / sample_time)), rest])


def excitation_path(spec: StepSpec, series: FourierSeries, sample_time: float) -> Array:
    """Poses (n, 3) that the chassis takes in one repeat of an excitation step."""
    position, _, _ = series.evaluate(sample_times(round(spec.period / sample_time), sample_time))
    return _path(spec, np.append(position, 0.0))


def turn_reference(
    spec: StepSpec, vehicle: VehicleDescription, parameters: Parameters, sample_time: float
) -> Reference:
    """Turn the vehicle on the spot by `spec.turn`: standstill, a quintic move, standstill."""
    duration = abs(spec.turn) / TURN_SPEED
    samples = round((duration + 2 * SETTLING) / sample_time)
    shape, rate, curvature = smooth_step((sample_times(samples, sample_time) - SETTLING) / duration)
    motion = spec.turn * shape, spec.turn * rate / duration, spec.turn * curvature / duration**2
    return _single_motion(spec, motion, np.full(samples, -1), vehicle, parameters, sample_time)


def _single_motion(
    spec: StepSpec,
    motion: tuple[Array, Array, Array],
    period: NDArray[np.int64],
    vehicle: VehicleDescription,
    parameters: Parameters,
    sample_time: float,
) -> Reference:
    """Reference of one coordinate at fixed steering angles, from its position, velocity and acceleration (N,)."""
    position, velocity, acceleration = motion
    alpha = np.tile(spec.steering(vehicle.geometry), (len(position), 1))
    if spec.mode is None:
        tracks, torques = _lifted(position, velocity, acceleration, vehicle.geometry, parameters)
    else:
        tracks = _tracks(spec, alpha, position, velocity, vehicle.geometry)
        torques = _feed_forward(spec, alpha, velocity, acceleration, vehicle.geometry, parameters)
    return Reference(spec.step, spec.coordinate, sample_time, tracks, torques, period, _path(spec, position))


def _path(spec: StepSpec, position: Array) -> Array:
    path = np.zeros((len(position), 3))
    if spec.coordinate in ("x", "y", "gamma"):
        path[:, ("x", "y", "gamma").index(spec.coordinate)] = -position if spec.reversed else position
    return path


def alignment_reference(
    start: Array, target: Array, vehicle: VehicleDescription, parameters: Parameters, sample_time: float
) -> Reference:
    """Wheel alignment at rest from steering angles `start` to `target` (2,), both sides at once.

    A stroke to just short of the target, then a creep onto it. The creep leaves Coulomb friction to the integrators
    (no feed-forward): when it ends, they hold the torque at which the wheel is about to move, and what is left of
    the error needs little more.
    """
    approach = target - np.where(target < start, -CREEP, CREEP)
    stroke_time = max(0.5, float(np.abs(approach - start).max()) / ALIGNMENT_SPEED)
    times = np.cumsum([SETTLING / 4, stroke_time, CREEP / CREEP_SPEED, ALIGNMENT_SETTLING])
    time = sample_times(round(times[-1] / sample_time), sample_time)
    stroke = _shaped_move((time - times[0]) / stroke_time, approach - start, stroke_time)
    creep = _shaped_move((time - times[1]) / (times[2] - times[1]), target - approach, times[2] - times[1])
    position, velocity, acceleration = (first + second for first, second in zip(stroke, creep, strict=True))
    alpha = start + position
    smooth = parameters.replaced(d_cl=0.0, d_cr=0.0, d_cw=0.0)
    torques = dynamics.feed_forward(Mode.ALIGNMENT, alpha, velocity, acceleration, smooth.values, vehicle.geometry)
    tracks = steering_tracks(alpha, velocity, vehicle.geometry)
    period = np.full(len(time), -1)
    return Reference(Step.ALIGNMENT, "alpha", sample_time, tracks, torques, period, np.zeros((len(time), 3)))


def _shaped_move(progress: Array, stroke: Array, duration: float) -> tuple[Array, Array, Array]:
    """Position, velocity and acceleration (N, 2) of a quintic move by `stroke` (2,)."""
    shape, rate, curvature = (values[:, None] for values in smooth_step(progress))
    return shape * stroke, rate * stroke / duration, curvature * stroke / duration**2


ALIGNMENT_SETTLING: Final = 3.0
"""Standstill after an alignment [s], in which the integrators bring the wheels into their dead band."""

CREEP: Final = 0.08
"""Last part of an alignment [rad]."""

CREEP_SPEED: Final = 0.04
"""Mean speed of it [rad/s]."""

ALIGNMENT_SPEED: Final = 0.8
"""Mean steering speed of an alignment [rad/s]."""


def sample_times(samples: int, sample_time: float) -> Array:
    """Times of a number of samples from zero (N,) [s]."""
    return np.asarray(np.arange(samples) * sample_time, dtype=np.float64)


def smooth_step(progress: Array) -> tuple[Array, Array, Array]:
    """Quintic from 0 to 1 over progress 0 to 1 with its first and second derivative, at rest outside."""
    t = np.clip(progress, 0.0, 1.0)
    return t**3 * (10 - 15 * t + 6 * t**2), 30 * t**2 * (1 - t) ** 2, 60 * t * (1 - t) * (1 - 2 * t)


def _padded(values: Array, rest: int) -> Array:
    return np.concatenate([np.zeros(rest), values, np.zeros(rest)])


def steering_tracks(alpha: Array, velocity: Array, geometry: Geometry) -> dict[str, Track]:
    """Both steering loops: angles (N, 2) [rad] and rates of them."""
    columns = kinematics.complement(Mode.ALIGNMENT, alpha[:1], geometry)[0, 5:]
    shape = (len(alpha), 4)
    return {
        name: Track(alpha[:, side], velocity[:, side], np.broadcast_to(columns[:, side], shape))
        for side, name in enumerate(STEERING_LOOPS)
    }


def _tracks(spec: StepSpec, alpha: Array, position: Array, velocity: Array, geometry: Geometry) -> dict[str, Track]:
    if spec.coordinate in STEERING_LOOPS:
        side = STEERING_LOOPS.index(spec.coordinate)
        moved, rate = alpha.copy(), np.zeros_like(alpha)
        moved[:, side] += position
        rate[:, side] = velocity
        return steering_tracks(moved, rate, geometry)
    assert spec.mode is not None
    row = kinematics.GENERALIZED_VELOCITIES[spec.mode].index(spec.coordinate)
    column = kinematics.complement(spec.mode, alpha[:1], geometry)[0, 5:, row]
    wheels = np.broadcast_to(column, (len(alpha), 4))
    held = steering_tracks(alpha, np.zeros_like(alpha), geometry)
    return {**held, spec.coordinate: Track(position, velocity, wheels)}


def _feed_forward(
    spec: StepSpec, alpha: Array, velocity: Array, acceleration: Array, geometry: Geometry, parameters: Parameters
) -> Array:
    assert spec.mode is not None
    names = kinematics.GENERALIZED_VELOCITIES[spec.mode]
    row = names.index(spec.coordinate)
    velocities, accelerations = np.zeros((2, len(alpha), len(names)))
    velocities[:, row], accelerations[:, row] = velocity, acceleration
    return dynamics.feed_forward(spec.mode, alpha, velocities, accelerations, parameters.values, geometry)


def _lifted(
    position: Array, velocity: Array, acceleration: Array, geometry: Geometry, parameters: Parameters
) -> tuple[dict[str, Track], Array]:
    rates, lifted = np.zeros((2, len(position), 9))
    rates[:, 5:], lifted[:, 5:] = velocity[:, None], acceleration[:, None]
    torques = (dynamics.regressor(rates, lifted) @ parameters.values)[:, 5:] / geometry.gear_ratio
    shape = (len(position), 4)
    tracks = {
        name: Track(position, velocity, np.broadcast_to(np.eye(4)[wheel], shape))
        for wheel, name in enumerate(LIFTED_LOOPS)
    }
    return tracks, torques

"""The size of an effect in noise units: what it does to the generalized torques, over what differs between periods.

Two runs differ by the effect alone. What the eleven columns of the model can absorb of the difference is no gap; the
rest, rms over moving samples, is taken in the coordinate where it is largest against its noise, and divided by the
period-to-period rms of that coordinate. Effects that move no torque but break the rolling constraints have the same
measure there, over the rms of what odometry leaves of the constraints without any effect and of the creep that rolling
wheels are granted: it repeats in every period, but not in the next campaign nor on another floor.

The two runs are driven without noise, so that they differ by nothing else: with it, an alignment more or less shifts
all noise that follows. The noise is that of a third run.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.campaign.steps import EXCITATIONS
from ident.diagnosis.observations.linear import rms
from ident.diagnosis.vehicle.causes.creep import granted_creep
from ident.estimate.equations import Equations, motion_of, usable_equations
from ident.estimate.filters import Processing, moving_rows, zero_phase
from ident.estimate.noise import noise_floor
from ident.plant import kinematics
from ident.records.record import Record, Segment, Step
from ident.vehicle.geometry import Geometry

Array = NDArray[np.float64]

_PROCESSING = Processing()


@dataclass(frozen=True)
class Noise:
    """Of a vehicle without effects.

    Attributes:
        torques: period-to-period rms of each generalized torque, by step and coordinate [Nm or N].
        slips: rms of what odometry leaves of the eight constraints, and of creep, by step (8,) [m/s].
    """

    torques: Mapping[tuple[str, str], float]
    slips: Mapping[str, Array]


@dataclass(frozen=True)
class SizeInNoise:
    """Size of an effect in noise units [-].

    Attributes:
        torque: of the generalized torques, after what the model absorbs.
        drift: of the generalized torques, nothing absorbed: what a model with given values does not explain.
        kinematic: of the rolling constraints.
    """

    torque: float
    drift: float
    kinematic: float


def noise_of(record: Record, values: Array, geometry: Geometry) -> Noise:
    """Noise of a run with repeats, parameters (11,) being those of the model."""
    floors = [noise_floor(rows, values) for rows in usable_equations(list(record.segments), geometry, _PROCESSING)]
    return Noise(
        {(floor.step, floor.coordinate): floor.noise for floor in floors},
        {segment.step: _slip_noise(segment, geometry) for segment in record.segments},
    )


def size_in_noise(noise: Noise, plain: Record, changed: Record, values: Array, geometry: Geometry) -> SizeInNoise:
    """Compare two runs of one plan, both without noise.

    Args:
        noise: of the vehicle.
        plain: without the effect.
        changed: with it.
        values: parameters of the model (11,).
        geometry: of the vehicle.
    """
    pairs = list(
        zip(
            usable_equations(list(plain.segments), geometry, _PROCESSING),
            usable_equations(list(changed.segments), geometry, _PROCESSING),
            strict=True,
        )
    )
    gaps, columns = [], []
    for one, other in pairs:
        kept, unit = one.moving & other.moving, noise.torques[one.step, one.coordinate]
        gaps.append((_residual(other, values) - _residual(one, values))[kept] / unit)
        columns.append(one.regressor[kept] / unit)
    left = np.concatenate(gaps) - _absorbed(np.concatenate(columns), np.concatenate(gaps))
    ends = np.cumsum([len(gap) for gap in gaps])[:-1]
    return SizeInNoise(
        torque=max(rms(part) for part in np.split(left, ends)),
        drift=max(rms(gap) for gap in gaps),
        kinematic=max(
            _slip_size(one, other, noise.slips[one.step], geometry)
            for one, other in zip(plain.segments, changed.segments, strict=True)
        ),
    )


def _residual(equations: Equations, values: Array) -> Array:
    return equations.torque - equations.regressor @ values


def _absorbed(columns: Array, gap: Array) -> Array:
    """Projection of a gap (N,) onto columns (N, 11)."""
    norms = np.linalg.norm(columns, axis=0)
    scaled = columns / np.where(norms > 0, norms, 1.0)
    return np.asarray(scaled @ np.linalg.lstsq(scaled, gap, rcond=None)[0])


def _slips(segment: Segment, geometry: Geometry) -> tuple[Array, NDArray[np.bool_]]:
    """What odometry leaves of the eight constraints (N, 8) [m/s], and where any wheel moves (N,)."""
    motion = motion_of(segment, geometry, _PROCESSING)
    slips = np.einsum("nij,nj->ni", kinematics.constraint_matrix(motion.alpha, geometry), motion.rates)
    fastest = np.abs(motion.rates[:, 5:]).max(axis=1, keepdims=True)
    moving = moving_rows(fastest, _PROCESSING, segment.sample_time)
    return zero_phase(slips, _PROCESSING.cutoff, segment.sample_time), moving


def _slip_size(plain: Segment, changed: Segment, noise: Array, geometry: Geometry) -> float:
    first, moving = _slips(plain, geometry)
    second, also_moving = _slips(changed, geometry)
    difference = (second - first)[moving & also_moving]
    return max(rms(difference[:, row]) / float(noise[row]) for row in range(8) if noise[row] > 0)


def _slip_noise(segment: Segment, geometry: Geometry) -> Array:
    slips, moving = _slips(segment, geometry)
    speed = geometry.wheel_radius * motion_of(segment, geometry, _PROCESSING).rates[moving, 5:]
    creep = granted_creep(EXCITATIONS[Step(segment.step)].mode, speed)
    return np.asarray(np.hypot(np.sqrt(np.mean(slips[moving] ** 2, axis=0)), creep))

"""The size of an effect in noise units: what it does to the generalized torques, over what differs between periods.

Two runs with one seed differ by the effect alone. What the eleven columns of the model can absorb of the difference
is no gap; the rest, rms over moving samples, is taken in the coordinate where it is largest against its noise, and
divided by the period-to-period rms of that coordinate. Effects that move no torque but break the rolling
constraints have the same measure there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.estimate.equations import Equations, motion_of, usable_equations
from ident.estimate.filters import Processing, moving_rows, zero_phase
from ident.estimate.noise import noise_floor
from ident.records.record import Record, Segment
from ident.vehicle import kinematics
from ident.vehicle.geometry import Geometry

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SizeInNoise:
    """Size of an effect in noise units, largest coordinate.

    Attributes:
        torque: of the generalized torques, after what the model absorbs [-].
        torque_coordinate: `step/coordinate` where that is.
        drift: of the generalized torques, nothing absorbed: of a changed parameter [-].
        kinematic: of the rolling constraints [-].
        kinematic_coordinate: `step` where that is.
    """

    torque: float
    torque_coordinate: str
    drift: float
    kinematic: float
    kinematic_coordinate: str


def size_in_noise(plain: Record, changed: Record, values: Array, geometry: Geometry) -> SizeInNoise:
    """Compare two runs with one seed and one plan.

    Args:
        plain: without the effect.
        changed: with it.
        values: parameters of the model (11,).
        geometry: of the vehicle.
    """
    processing = Processing()
    rows = list(
        zip(
            usable_equations(list(plain.segments), geometry, processing),
            usable_equations(list(changed.segments), geometry, processing),
            strict=True,
        )
    )
    noise = [noise_floor(one, values).noise for one, _ in rows]
    masks = [one.moving & other.moving & (one.period >= 0) for one, other in rows]
    difference = [
        _residual(other, values)[m] - _residual(one, values)[m] for (one, other), m in zip(rows, masks, strict=True)
    ]
    weighted = [d / n for d, n in zip(difference, noise, strict=True)]
    columns = np.concatenate([one.regressor[m] / n for (one, _), m, n in zip(rows, masks, noise, strict=True)])
    stacked = np.concatenate(weighted)
    scale = np.linalg.norm(columns, axis=0)
    scale[scale == 0] = 1.0
    absorbed = (columns / scale) @ np.linalg.lstsq(columns / scale, stacked, rcond=None)[0]
    ends = np.cumsum([len(d) for d in weighted])[:-1]
    left = [_rms(part) for part in np.split(stacked - absorbed, ends)]
    names = [f"{one.step}/{one.coordinate}" for one, _ in rows]
    kinematic = _kinematic(plain, changed, geometry, processing)
    worst = max(kinematic, key=lambda step: kinematic[step])
    return SizeInNoise(
        torque=max(left),
        torque_coordinate=names[int(np.argmax(left))],
        drift=max(_rms(part) for part in weighted),
        kinematic=kinematic[worst],
        kinematic_coordinate=worst,
    )


def _residual(equations: Equations, values: Array) -> Array:
    return equations.torque - equations.regressor @ values


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0


def _kinematic(plain: Record, changed: Record, geometry: Geometry, processing: Processing) -> dict[str, float]:
    """By step: rms of the difference in what odometry leaves of the eight constraints, over its noise."""
    sizes = {}
    for one, other in zip(plain.segments, changed.segments, strict=True):
        first, moving = _slips(one, geometry, processing)
        second, also_moving = _slips(other, geometry, processing)
        mask = moving & also_moving & (one.period >= 0)
        noise = _period_noise(first, one.period, mask)
        if mask.any():
            sizes[one.step] = max(_rms((second - first)[mask, row]) / noise[row] for row in range(8) if noise[row] > 0)
    return sizes


def _slips(segment: Segment, geometry: Geometry, processing: Processing) -> tuple[Array, NDArray[np.bool_]]:
    motion = motion_of(segment, geometry, processing)
    constraints = kinematics.constraint_matrix(motion.alpha, geometry)
    slips = np.einsum("nij,nj->ni", constraints, motion.rates)
    moving = moving_rows(np.abs(motion.rates[:, 5:]).max(axis=1, keepdims=True), processing, segment.sample_time)
    return zero_phase(slips, processing.cutoff, segment.sample_time), moving


def _period_noise(slips: Array, period: NDArray[np.int64], mask: NDArray[np.bool_]) -> Array:
    numbers = [number for number in np.unique(period) if number >= 0]
    folded = np.stack([np.where(mask[period == number, None], slips[period == number], np.nan) for number in numbers])
    return np.asarray(np.sqrt(np.nanmean(np.nanvar(folded, axis=0, ddof=1), axis=0)))

"""Moments in which wheels give way to one another, and the equations of rolling ones do not hold.

Wheels that an alignment has left a few increments askew push each other aside, until at some speed the steering moves
and they slide, for some tenths of a second. What they run ahead by is nothing to the rolling rows, but while it comes
and goes the vehicle does not accelerate as its wheels do: every time at the highest speeds, it looks like a drag.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ident.diagnosis.observations.linear import least_squares
from ident.diagnosis.problem import Channel
from ident.diagnosis.vehicle.records.inputs import SLICES
from ident.diagnosis.vehicle.records.sliding import MOVING, ahead_of_the_rest
from ident.diagnosis.vehicle.records.sources import Source
from ident.estimate.filters import Processing, zero_phase
from ident.records.repeats import repeats_of
from ident.vehicle.geometry import Geometry

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

GIVING_WAY: Final = 2e-4
"""Speed by which a wheel must run ahead, beside what goes with its speed and its creep, to have given way [m/s]."""

GIVING_WAY_CUTOFF: Final = 30.0
"""Of the filter through which that is looked at [rad/s]: encoders leave a tenth of `GIVING_WAY` there."""

MOMENTARY: Final = 0.45
"""Part of the motion of a step that wheels may give way for; what takes more belongs to the vehicle [-].

On cases of an exam for tuning, moments took 0.1 to 0.4; low friction, plays and compliances mostly 0.5 to 1.
"""


def apart_from_moments(sources: Sequence[Source], geometry: Geometry, processing: Processing) -> Iterator[Source]:
    """The sources of one record, forces not looked at where wheels give way for a moment.

    What is lost in one repeat is lost in all. Where that is most of the motion of some drive, or a motor rattles, it is
    the vehicle that is so, and everything is looked at.
    """
    looked_at = [_undisturbed(source, geometry, processing) for source in sources]
    lasts = any(
        source.rattles.any() or any(_lost(mask, clear, source.period) >= MOMENTARY for mask in source.moving)
        for source, clear in zip(sources, looked_at, strict=True)
    )
    for source, clear in zip(sources, looked_at, strict=True):
        yield source if lasts else replace(source, moving=tuple(mask & clear for mask in source.moving))


def _undisturbed(source: Source, geometry: Geometry, processing: Processing) -> Mask:
    """Where (M,) the forces of a source are those of rolling wheels; everywhere in rows that say nothing of forces."""
    if source.channel is not Channel.DYNAMIC or not source.travels:
        return np.ones(len(source.inputs), dtype=bool)
    moments = giving_way(source.inputs, geometry, source.sample_time)
    # What gives way was looked at through one filter, and the rows pass another: each remembers as long as the guard.
    width = 4 * round(processing.guard / source.sample_time) + 1
    return np.asarray(~ndimage.binary_dilation(moments, np.ones(width, dtype=bool)))


def _lost(moving: Mask, clear: Mask, period: NDArray[np.int64]) -> float:
    """Part of the motion that is lost where the same phase of every repeat is."""
    samples = repeats_of(period)
    moves, lost = np.all(moving[samples], axis=0), np.any(~clear[samples], axis=0)
    return float(np.mean(lost, where=moves)) if moves.any() else 0.0


def giving_way(inputs: Array, geometry: Geometry, sample_time: float) -> Mask:
    """Moments (N,) in which wheels of a drive, `inputs` (N, INPUTS), run ahead of one another and do not roll.

    What runs ahead in proportion to its speed is another radius, and in proportion to its speed and its torque it
    creeps; neither is meant.
    """
    rates = geometry.wheel_radius * inputs[:, SLICES["beta_rate"]]
    moving = np.abs(rates).min(axis=1) > MOVING
    ahead = zero_phase(ahead_of_the_rest(inputs, geometry, sample_time), GIVING_WAY_CUTOFF, sample_time)
    lasting = np.stack([rates, np.abs(rates) * inputs[:, SLICES["torques"]]], axis=2)
    beside = [
        column - regular @ least_squares(regular[moving], column[moving])
        for column, regular in zip(ahead.T, np.swapaxes(lasting, 0, 1), strict=True)
    ]
    return np.asarray(moving & np.any(np.abs(beside) > GIVING_WAY, axis=0))

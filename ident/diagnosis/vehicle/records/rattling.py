"""Motors that rattle in the play of their gears or ring on their compliance: when, what it does, what it shows.

Between the flanks a motor is free, so that a speed controller throws it from one to the other, many times a second.
Its wheel hammers the floor and slides there, one way or the other, a hundred times as far as any that rolls, and shakes
the steering loose. So the rolling rows of such a drive say nothing, and that wheel is taken to roll as the others do.
What they lose stands above their bandwidth: β, what the motor moves beyond what the others say of its wheel, is there
what its gear gives way by, under a load that is known. That is a row of its own, made slow by weighing it with itself:

    R <(β_f - twist_f) β_f / |β_f|> = 0,

x_f being x above `BAND`, |β_f| the rms of the motor there, <.> what passes the filter of all rows.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.vehicle.records.inputs import SLICES
from ident.diagnosis.vehicle.records.rows import OwnRows
from ident.estimate.filters import Processing, zero_phase
from ident.vehicle.geometry import WHEELS, Geometry

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

BAND: Final = 150.0
"""Above which a motor rattles [rad/s]; no excitation goes there. Below, its wheel is made to roll as the others do."""

LEAST: Final = 1e-4
"""Rms by which a motor must move above the band to rattle, at the wheel [rad]: ten times what dry friction makes."""

ABOVE_OTHERS: Final = 5.0
"""The same over that of the quietest motor, whose encoder has the same noise; what all show is no gear's."""

OFTEN: Final = 0.1
"""Part of a drive that a motor must rattle for; what it has shaken loose then slides on in all of it [-].

On the emulator motors in a play do so for 0.6 to 0.96 of it, those of wheels on a slippery floor for up to 0.053.
"""

OFTEN_AT_STANDSTILL: Final = 0.05
"""The same of a step at standstill."""

UNTOLD: Final = 0.03
"""Part of its motion that may stay unexplained: of a motor in flight the slow part is told by its load alone [-]."""

SHAKEN: Final = 0.01
"""Part of the generalized forces of such a drive that may stay unexplained: wheels that slide push each other [-]."""


def above_band(values: Array, sample_time: float) -> Array:
    """What of values (N, ...) is faster than what the vehicle drives."""
    return np.asarray(values - zero_phase(values, BAND, sample_time))


def rattling(beta: Array, processing: Processing, sample_time: float) -> tuple[Array, Mask]:
    """Rms motion of the motors above the band (N, 4) [rad], and where each that often rattles does so (N, 4).

    Where all four do, none is said to: no wheel is left that rolls.

    Args:
        beta: angles of the motors in a drive, at the wheels (N, 4) [rad].
        processing: its filter is what the rows pass.
        sample_time: [s].
    """
    rms = _rms_above_band(beta, processing, sample_time)
    rattles = _often(rms > np.maximum(LEAST, ABOVE_OTHERS * rms.min(axis=1, keepdims=True)), OFTEN)
    return rms, rattles & ~rattles.any(axis=0).all()


def rattling_at_standstill(beside: Array, processing: Processing, sample_time: float) -> tuple[Array, Mask]:
    """The same of the two motors (N, 2) of a unit that steers, as they move beside its encoder.

    What both do is the unit's, which jumps where its friction reverses, or whose encoder is late.

    Args:
        beside: angles of the motors less that of the unit, the way it turns, at the wheels (N, 2) [rad].
        processing: its filter is what the rows pass.
        sample_time: [s].
    """
    rms = _rms_above_band(np.column_stack([beside, beside[:, 0] - beside[:, 1]]), processing, sample_time)
    return rms[:, :2], _often((rms[:, :2] > LEAST) & (rms[:, 2:] > LEAST), OFTEN_AT_STANDSTILL)


def _rms_above_band(values: Array, processing: Processing, sample_time: float) -> Array:
    power = zero_phase(above_band(values, sample_time) ** 2, processing.cutoff, sample_time)
    return np.asarray(np.sqrt(np.maximum(power, 0.0)))


def _often(rattles: Mask, least: float) -> Mask:
    return np.asarray(rattles & (rattles.mean(axis=0) > least))


def hammer(moved: Array, rms: Array) -> Array:
    """Weights (N, 4) that make a motion above the band slow: that of each motor over its rms."""
    return np.asarray(moved / np.maximum(rms, LEAST))


def swing(rms: Array) -> Array:
    """Amplitude (N, 4) of a sinusoid as strong as the motions above the band [rad]."""
    return np.asarray(math.sqrt(2) * np.maximum(rms, LEAST))


def moved_by(weights: Array, swings: Array) -> Array:
    """Motion above the band (N,) of a motor that has these weights and swings [rad]."""
    return np.asarray(weights * swings / math.sqrt(2))


def rattle_rows(wheels: Sequence[int], geometry: Geometry) -> OwnRows:
    """How far the motors of some wheels (0 to 3) move with the hammer, beyond what their gears give way by [m]."""
    names = tuple(f"rattle_{WHEELS[wheel]}" for wheel in wheels)
    columns = tuple(SLICES["rattle"].start + wheel for wheel in wheels)
    return OwnRows(names, columns, geometry.wheel_radius, UNTOLD)

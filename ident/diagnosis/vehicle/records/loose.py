"""What is loose in a drive: motors that rattle in their gears or move at rest, a rear unit that wanders."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from ident.diagnosis.vehicle.records.inputs import SLICES, copied
from ident.diagnosis.vehicle.records.rattling import (
    above_band,
    hammer,
    rattle_rows,
    rattling,
    rattling_at_standstill,
    swing,
)
from ident.diagnosis.vehicle.records.resting import moved_at_rest, rest_rows
from ident.diagnosis.vehicle.records.rows import OwnRows
from ident.diagnosis.vehicle.records.signals import Signals
from ident.diagnosis.vehicle.records.sliding import rolled_with_others, rolling_rates
from ident.diagnosis.vehicle.records.wandering import wander_rows, wandering
from ident.estimate.equations import RowsOfStep
from ident.estimate.filters import Processing, away_from_ends
from ident.plant import kinematics
from ident.plant.modes import Mode
from ident.vehicle.geometry import WHEELS, Geometry

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

ASKEW: Final = 0.4
"""Steering angle beyond which a wheel that steers at standstill pushes the chassis aside [rad]."""

_SIDES: Final = ((0, 1), (2, 3))
"""Front and rear wheel of either side."""


@dataclass(frozen=True)
class Loose:
    """A drive and what is loose in it.

    Attributes:
        inputs: (N, INPUTS) signals with what is loose in columns of its own, wheels rolling in spite of it.
        rattles: (N, 4) where the motor of each wheel rattles in its gear.
        rolls: whether rolling rows of the drive tell how the wheels roll.
        own: rows of motors that rattle or move at rest, of a unit that may wander; of each, where they are to be used,
            a mask (N,) for each of its coordinates.
    """

    inputs: Array
    rattles: Mask
    rolls: bool
    own: tuple[tuple[OwnRows, tuple[Mask, ...]], ...] = ()


def as_it_was(recorded: Array) -> Loose:
    """Signals (N, INPUTS) of a drive in which nothing is taken to be loose."""
    return Loose(recorded, _none(recorded), rolls=True)


def taken_apart(
    recorded: Array, signals: Signals, spec: RowsOfStep, geometry: Geometry, processing: Processing
) -> Loose:
    """Signals (N, INPUTS) of a drive, and what is loose in it; in the air no floor is hammered."""
    if spec.mode is None:
        return as_it_was(recorded)
    if spec.mode is Mode.ALIGNMENT:
        return _at_standstill(recorded, signals, _side(spec), geometry, processing)
    dt = signals.segment.sample_time
    rms, rattles = rattling(signals.beta, processing, dt)
    if not rattles.any():
        return Loose(recorded, rattles, rolls=True)
    motors = np.flatnonzero(rattles.any(axis=0)).tolist()
    inside = away_from_ends(rattles, processing, dt)
    moving = tuple(inside[:, wheel] for wheel in motors)
    inputs = _hammered(recorded, rms, rattles, geometry, dt)
    return Loose(inputs, rattles, rolls=False, own=((rattle_rows(motors, geometry), moving),))


def near_middle(signals: Signals) -> Mask:
    """Where (N,) no wheel that steers at standstill pushes the chassis aside."""
    return np.asarray(np.all(np.abs(signals.alpha) < ASKEW, axis=1))


def _at_standstill(recorded: Array, signals: Signals, side: int, geometry: Geometry, processing: Processing) -> Loose:
    """A motor that rattles has no rows there: what swings back is the steered unit, which no other wheel shows."""
    dt, wheels = signals.segment.sample_time, list(_SIDES[side])
    rms, rattles = np.zeros(signals.beta.shape), _none(recorded)
    turned = signals.beta[:, wheels] / _turned_by_steering(geometry)[wheels, side]
    beside = geometry.lever_ratio * (turned - signals.alpha[:, [side]])
    rms[:, wheels], rattles[:, wheels] = rattling_at_standstill(beside, processing, dt)
    if rattles.any():
        return Loose(_hammered(recorded, rms, rattles, geometry, dt), rattles, rolls=False)
    near, inputs, own = near_middle(signals), copied(recorded), []
    # One number for the whole step: when a motor or a unit crosses differs from repeat to repeat.
    resting = list(_SIDES[1 - side])
    for wheel, across in zip(resting, moved_at_rest(signals.beta[:, resting], near).tolist(), strict=True):
        if across > 0:
            inputs[near, SLICES["rest"].start + wheel] = across
            own.append((rest_rows(wheel, geometry), (near,)))
    moving = np.abs(signals.alpha_rate[:, side]) > processing.moving
    found = wandering(signals.alpha[:, side], turned, signals.torques[:, wheels], near, moving, dt)
    if found is not None:
        inputs[near, SLICES["wander"].start + side] = found.across
        own.append((wander_rows(side, geometry), (near & (not found.foretold),)))
    return Loose(inputs, rattles, rolls=True, own=tuple(own))


def _none(recorded: Array) -> Mask:
    return np.zeros((len(recorded), len(WHEELS)), dtype=np.bool_)


def _side(spec: RowsOfStep) -> int:
    return kinematics.GENERALIZED_VELOCITIES[Mode.ALIGNMENT].index(spec.coordinates[0])


def _turned_by_steering(geometry: Geometry) -> Array:
    """Angles (4, 2) by which the wheels roll as either side steers at standstill [rad/rad]."""
    found = kinematics.complement(Mode.ALIGNMENT, np.zeros((1, 2)), geometry)[0]
    return np.asarray(found[-len(WHEELS) :])


def _hammered(recorded: Array, rms: Array, rattles: Mask, geometry: Geometry, sample_time: float) -> Array:
    """Signals (N, INPUTS) with what motors do that rattle, and with wheels that roll in spite of it."""
    wheels = np.flatnonzero(rattles.any(axis=0)).tolist()
    rolled = rolling_rates(recorded, wheels, geometry)
    inputs = rolled_with_others(recorded, wheels, rolled, sample_time)
    against = recorded[:, SLICES["beta"]].copy()
    against[:, wheels] -= cumulative_trapezoid(rolled, dx=sample_time, axis=0, initial=0)
    moved = above_band(against, sample_time)
    weights = np.where(rattles, hammer(moved, rms), 0.0)
    inputs[:, SLICES["hammer"]], inputs[:, SLICES["rattle"]] = weights, weights * moved
    inputs[:, SLICES["swing"]] = np.where(rattles, swing(rms), 0.0)
    return inputs

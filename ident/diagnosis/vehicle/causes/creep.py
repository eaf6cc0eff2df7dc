"""Creep: how far a rolling contact gives way under its traction, which no model of rigid rolling has.

A tyre that pulls slips in proportion to its traction over its load, by a number of its own; so does a wheel that stands
askew on dry ground, whose friction points the less along its plane the less it slips along it. The vehicle moves by as
much less than its wheels roll: rolling rows show by how much they differ, those of the forces what all have in common,
a mass times how that changes. Turning on the spot, wheels stand askew otherwise than driving straight, and may all slip
by another number. What is tolerated in the rolling rows beyond that is what proportion does not cover.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.observations.linear import rms
from ident.diagnosis.vehicle.causes.context import Context
from ident.diagnosis.vehicle.records.inputs import SLICES
from ident.diagnosis.vehicle.records.sliding import roll, traction, wheel_load
from ident.diagnosis.vehicle.records.sources import Source
from ident.diagnosis.vehicle.records.transforms import Setting
from ident.plant.modes import Mode
from ident.vehicle.geometry import WHEELS, Geometry

Array = NDArray[np.float64]

CREEP_NAMES: Final = (*(f"creep_{wheel}" for wheel in WHEELS), "creep_rotation")
"""Slip of each wheel, over its rolling speed, for a traction as large as its load, and by how much more all of them do
turning on the spot [-]."""

PROBE: Final = 1e-3
"""Creep that columns are made with: rows are linear in it."""

CREEP_STD: Final = 0.03
"""Standard deviation of those numbers beforehand: tyres take ten (air) to a hundred times their load for full slip."""

GRANTED: Final = 3e-4
"""Part of the rolling speed by which a wheel may creep, as any tyre does at some percent of its adhesion [-]."""

TURNING: Final = 1e-3
"""The same for wheels that turn about their steering axes at standstill, where the chassis is held by creep alone."""

LEFT_OVER: Final[Mapping[str, float]] = MappingProxyType(
    {"front_rear_left": 1e-4, "front_rear_right": 1e-4, "left_right": 4e-5}
)
"""Part of the rolling speed that a contact may give way beside its creep in proportion, by coordinate [-].

Front and rear wheels are held parallel by a coupling that gives way itself, which leaves more between them.
"""


def granted_creep(mode: Mode | None, speed: Array) -> float:
    """What creep takes (rms) from contacts that roll at some speeds (..., 4) [m/s] in a mode [m/s]."""
    return (TURNING if mode is Mode.ALIGNMENT else GRANTED) * rms(speed)


def tolerated_creep(source: Source, coordinate: str, geometry: Geometry) -> float:
    """What a kinematic coordinate may lack beside creep in proportion to traction, rms [m/s]."""
    return LEFT_OVER.get(coordinate, TURNING) * rms(contact_speeds(source, geometry))


def contact_speeds(source: Source, geometry: Geometry) -> Array:
    """At which the wheels roll in the moving rows of a kinematic source (N, 4) [m/s]."""
    return np.asarray(geometry.wheel_radius * source.inputs[source.moving[0], SLICES["beta_rate"]])


def creep_columns(source: Source, context: Context) -> Array:
    """What the rows of a source have of unit creep, before the filter (M, rows, CREEP_NAMES)."""
    inputs, setting, plain = context.inputs(source), context.setting(source), context.plain(source)
    columns = []
    for wheel in range(len(WHEELS)):
        rolled = inputs.copy()
        roll(rolled, wheel, PROBE * _slip(inputs, wheel, setting) / setting.geometry.wheel_radius, setting)
        columns.append((context.rows_of(rolled, source) - plain)[..., 0] / PROBE)
    turning = float(source.spec.mode is Mode.ROTATION)
    return np.stack([*columns, turning * np.sum(columns, axis=0)], axis=-1)


def _slip(inputs: Array, wheel: int, setting: Setting) -> Array:
    """Slip of a wheel (N,) under its traction for unit creep [m/s]."""
    speed = np.abs(setting.geometry.wheel_radius * inputs[:, SLICES["beta_rate"]][:, wheel])
    return np.asarray(speed * traction(inputs, wheel, setting) / wheel_load(inputs, setting))

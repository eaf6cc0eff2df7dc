"""Creep: how far a rolling contact gives way under its traction, which no model of rigid rolling has.

A tyre that pulls slips in proportion to its traction over its load, by a number of its own. That is a column for each
wheel in the rolling rows, fitted with everything else; what is tolerated beyond it is what proportion does not cover.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.observations.linear import rms
from ident.diagnosis.vehicle.records.inputs import SLICES
from ident.diagnosis.vehicle.records.rows import in_coordinates
from ident.diagnosis.vehicle.records.sliding import traction, wheel_load
from ident.diagnosis.vehicle.records.sources import Source
from ident.diagnosis.vehicle.records.transforms import Setting
from ident.plant import kinematics
from ident.plant.modes import Mode
from ident.vehicle.geometry import WHEELS, Geometry

Array = NDArray[np.float64]

CREEP_NAMES: Final = tuple(f"creep_{wheel}" for wheel in WHEELS)
"""Slip of a wheel, over its rolling speed, for a traction as large as its load [-]."""

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


def creep_columns(inputs: Array, source: Source, setting: Setting) -> Array:
    """What the rolling rows of a source have of unit creep of every wheel, (N, rows, 4) [m/s].

    Args:
        inputs: signals (N, INPUTS).
        source: kinematic.
        setting: of the vehicle; its forces are those of the contacts along the wheels' planes.
    """
    chassis = kinematics.constraint_matrix(inputs[:, SLICES["alpha"]], setting.geometry)[:, :, :3]
    slips = np.stack([_slip(inputs, wheel, setting) for wheel in range(len(WHEELS))], axis=1)
    along = chassis[:, 4:]
    twists = np.linalg.solve(np.einsum("nki,nkj->nij", chassis, chassis), np.swapaxes(along, 1, 2) * slips[:, None])
    # (N, row of the wheel, creeping wheel): what no twist of the chassis takes away.
    left = np.eye(len(WHEELS)) * slips[:, None] - along @ twists
    return np.stack(in_coordinates(list(np.swapaxes(left, 0, 1)), source.spec), axis=1)


def _slip(inputs: Array, wheel: int, setting: Setting) -> Array:
    """Slip of a wheel (N,) under its traction for unit creep [m/s]."""
    speed = np.abs(setting.geometry.wheel_radius * inputs[:, SLICES["beta_rate"]][:, wheel])
    return np.asarray(speed * traction(inputs, wheel, setting) / wheel_load(inputs, setting))

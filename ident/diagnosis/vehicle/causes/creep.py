"""Creep: how far a rolling contact gives way under its traction, which no model of rigid rolling has.

A tyre that pulls slips in proportion to its traction over its load, by a number of its own. The vehicle moves by as
much less than its wheels roll: rolling rows show by how much they differ, those of the forces what all have in common,
a mass times how that changes. Turning on the spot all of them may slip by another number. That is a column for each in
the rows, fitted with everything else; what is tolerated in the rolling rows beyond it is what proportion does not
cover.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.observations.linear import rms
from ident.diagnosis.vehicle.causes.context import Context
from ident.diagnosis.vehicle.causes.contribution import contribution_of
from ident.diagnosis.vehicle.records.inputs import SLICES, copied
from ident.diagnosis.vehicle.records.sliding import roll, traction, wheel_load
from ident.diagnosis.vehicle.records.sources import Source
from ident.diagnosis.vehicle.records.transforms import Setting
from ident.plant.modes import Mode
from ident.vehicle.geometry import WHEELS, Geometry

Array = NDArray[np.float64]

CREEP_NAMES: Final = (*(f"creep_{wheel}" for wheel in WHEELS), "creep_rotation")
"""Slip of each wheel, over its rolling speed, for a traction as large as its load, and by how much more all of them do
turning on the spot [-]."""

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


def tolerated_over_time(source: Source) -> Array:
    """What is tolerated in every sample (N,) over `tolerated_creep`, of rms one in the moving rows.

    Half of its power goes with the square of the rolling speed. Half is there at every moment: where steering or
    driving reverses, contacts are pushed, and sampling is late.
    """
    rates = source.inputs[:: source.factor, SLICES["beta_rate"]]
    power, usual = np.mean(rates**2, axis=1), rms(rates[source.moving[0][:: source.factor]]) ** 2
    return np.asarray(np.sqrt((1 + power / usual) / 2 if usual > 0 else np.ones_like(power)))


def contact_speeds(source: Source, geometry: Geometry) -> Array:
    """At which the wheels roll in the moving rows of a kinematic source (N, 4) [m/s]."""
    return np.asarray(geometry.wheel_radius * source.inputs[source.moving[0], SLICES["beta_rate"]])


@dataclass(frozen=True)
class Creep:
    """Creep of a wheel; its size is the slip, over the rolling speed, for a traction as large as the load."""

    wheel: int

    def without(self, inputs: Array, sizes: Array, setting: Setting) -> Array:
        """Signals (N, INPUTS) as if it had rolled."""
        speed = np.abs(setting.geometry.wheel_radius * inputs[:, SLICES["beta_rate"]][:, self.wheel])
        slip = sizes[0] * speed * traction(inputs, self.wheel, setting) / wheel_load(inputs, setting)
        changed = copied(inputs)
        roll(changed, self.wheel, slip / setting.geometry.wheel_radius, setting)
        return changed


def creep_columns(sources: Sequence[Source], context: Context) -> list[Array]:
    """What unit creep adds to the rows of every block, (N, CREEP_NAMES) [m/s, N or Nm].

    To first order: by a finite difference at `GRANTED`.
    """
    acting = [source.own is None and source.spec.mode is not None for source in sources]
    wheels = [
        contribution_of(Creep(wheel), acting, sources, context)(np.array([GRANTED]), context.parameters)
        for wheel in range(len(WHEELS))
    ]
    found, blocks = [], [source for source in sources for _ in source.coordinates]
    for source, *added in zip(blocks, *wheels, strict=True):
        nothing = np.zeros(len(source.inputs[:: source.factor]))
        columns = [nothing if one is None else one / GRANTED for one in added]
        turning = np.sum(columns, axis=0) if source.spec.mode is Mode.ROTATION else nothing
        found.append(np.column_stack([*columns, turning]))
    return found

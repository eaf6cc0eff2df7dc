"""At which sizes the effects are probed, and how large they are in practice: the rows of the table of sizes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from emulator.effects import INJECTORS
from hil.exam.cases import Injected
from ident.diagnosis.names import EffectName, places_of
from ident.effects import EFFECTS
from ident.vehicle.description import VehicleDescription

SHARES: Final = (0.6, 1.0)
"""Of the largest size, at which every effect is driven first; nearer to the noise after that."""

SMALLER: Final = (0.3, 0.1)
"""Shares at which it is driven where the vehicle cannot be driven with more."""

IDLE: Final = 0.4
"""Share at which an effect with a threshold does nothing yet."""


@dataclass(frozen=True)
class Probe:
    """An effect at a place, before it is measured.

    Attributes:
        name, where, parameter, unit: as in the table.
        measured_at: the place that stands for it: left and right, front and rear wheels are alike.
        largest: in practice.
        known: whether the library has a candidate.
    """

    name: str
    where: str
    parameter: str
    unit: str
    measured_at: str
    largest: float
    known: bool

    def injected(self, size: float) -> Injected:
        """The effect at the place that stands for it."""
        return Injected(self.name, self.measured_at, self.parameter, size)


STRANGERS: Final = tuple(sorted(name for name, injector in INJECTORS.items() if not injector.known))
"""Effects that no model has."""

EVERY: Final = frozenset((*map(str, EffectName), *STRANGERS))
"""Names of all effects that have a size."""

_STAND_INS: Final = {"wheel": "wheel_fl", "drive": "drive_fl"}


def all_probes(vehicle: VehicleDescription) -> Iterator[Probe]:
    """Every effect at every place where the diagnosis looks for it, then those that no model has."""
    for name in EffectName:
        kind = EFFECTS[name]
        for where in places_of(name):
            stand_in, size = _STAND_INS.get(where.partition("_")[0], where), kind.size.name
            largest = kind.usual(vehicle, stand_in)
            yield Probe(str(name), where, size, kind.unit(size, where), stand_in, largest, True)
    for stranger in map(INJECTORS.__getitem__, STRANGERS):
        for where in stranger.places:
            yield Probe(stranger.name, where, stranger.size, stranger.unit(where), where, stranger.largest, False)

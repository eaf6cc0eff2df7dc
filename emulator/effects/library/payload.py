"""A load over the centre of the chassis."""

from __future__ import annotations

from typing import Final

from emulator.effects.base import Injector, Placed
from emulator.effects.bodies import load_payload
from emulator.effects.injection import Injection
from emulator.effects.places import CHASSIS


def _inject(injection: Injection, effect: Placed) -> Injection:
    return injection.with_prototype(load_payload(injection.built.prototype, effect["mass"], effect["inertia"]))


INJECTOR: Final = Injector(
    name="payload",
    places=CHASSIS,
    units={"mass": "kg", "inertia": "kg m^2"},
    inject=_inject,
)

"""A wheel that is larger than the vehicle file says."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from emulator.effects.base import Injector, Placed
from emulator.effects.injection import Injection
from emulator.effects.places import EACH_WHEEL


def _inject(injection: Injection, effect: Placed) -> Injection:
    return injection.with_wheels(effect.where, lambda wheel: replace(wheel, radius=wheel.radius + effect["error"]))


INJECTOR: Final = Injector(
    name="wheel_radius",
    places=EACH_WHEEL,
    units={"error": "m"},
    inject=_inject,
    signed=True,
    breaks_rolling=True,
)

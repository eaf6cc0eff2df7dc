"""A wheel that does not turn about its centre."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from emulator.effects.base import Injector, Placed
from emulator.effects.injection import Injection
from emulator.effects.places import EACH_WHEEL


def _inject(injection: Injection, effect: Placed) -> Injection:
    return injection.with_wheels(
        effect.where, lambda wheel: replace(wheel, eccentricity=effect["amplitude"], phase=effect["phase"])
    )


INJECTOR: Final = Injector(
    name="wheel_eccentricity",
    places=EACH_WHEEL,
    units={"amplitude": "m", "phase": "rad", "warp": "1"},
    inject=_inject,
    exclusive=True,
)

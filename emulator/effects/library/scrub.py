"""Contact patches that resist turning on the spot."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from emulator.effects.base import Injector, Placed
from emulator.effects.injection import Injection
from emulator.effects.places import CHASSIS, EACH_SIDE, wheels_of


def _inject(injection: Injection, effect: Placed) -> Injection:
    share = effect.not_negative("torque") / len(wheels_of(effect.where))
    return injection.with_wheels(effect.where, lambda wheel: replace(wheel, patch_torque=wheel.patch_torque + share))


INJECTOR: Final = Injector(
    name="scrub",
    places=(*EACH_SIDE, *CHASSIS),
    units={"torque": "Nm"},
    inject=_inject,
)

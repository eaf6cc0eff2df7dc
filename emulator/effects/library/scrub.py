"""Contact patches that resist turning on the spot."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from emulator.effects.base import Injector, Placed
from emulator.effects.injection import Injection
from emulator.effects.places import CHASSIS, EACH_SIDE, wheels_of
from ident.errors import UserError


def _inject(injection: Injection, effect: Placed) -> Injection:
    torque = effect["torque"]
    if torque < 0:
        raise UserError(f"{effect}: a contact patch that resists turning is not negative.", "Give a positive number.")
    share = torque / len(wheels_of(effect.where))
    return injection.with_wheels(effect.where, lambda wheel: replace(wheel, patch_torque=wheel.patch_torque + share))


INJECTOR: Final = Injector(
    name="scrub",
    places=(*EACH_SIDE, *CHASSIS),
    units={"torque": "Nm"},
    inject=_inject,
)

"""A floor that is inclined: gravity in the engine's world turns."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

from emulator.effects.base import Injector, Placed
from emulator.effects.injection import Injection
from emulator.effects.places import CHASSIS
from ident.errors import UserError
from ident.vehicle.quantities import GRAVITY


def _inject(injection: Injection, effect: Placed) -> Injection:
    prototype = injection.built.prototype
    pull = prototype.truth["m_ch"] * GRAVITY * abs(math.sin(effect["angle"]))
    hold = 4 * prototype.truth["d_cw"] / prototype.geometry.wheel_radius
    if pull >= hold:
        steepest = math.degrees(math.asin(hold / prototype.truth["m_ch"] / GRAVITY))
        raise UserError(
            f"{effect}: the vehicle has no brakes and would roll away with its drives off.",
            f"Its friction holds it on at most {steepest:.2f}deg.",
        )
    return replace(injection, built=replace(injection.built, slope=effect["angle"], uphill=effect["direction"]))


INJECTOR: Final = Injector(
    name="slope",
    places=CHASSIS,
    units={"angle": "rad", "direction": "rad"},
    inject=_inject,
    signed=True,
)

"""Wheels or a floor of less grip than usual: beyond it they slide."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from emulator.effects.base import Injector, Placed
from emulator.effects.injection import Injection
from emulator.effects.places import CHASSIS, EACH_WHEEL
from ident.errors import UserError


def _inject(injection: Injection, effect: Placed) -> Injection:
    if effect["friction"] <= 0:
        raise UserError(f"{effect}: a friction coefficient is positive.", "Give one above zero.")
    # The engine multiplies the coefficients of tyre and floor.
    grip = effect["friction"] / injection.built.prototype.floor_friction
    return injection.with_wheels(effect.where, lambda wheel: replace(wheel, grip=grip))


INJECTOR: Final = Injector(
    name="slip",
    places=(*CHASSIS, *EACH_WHEEL),
    units={"friction": "1"},
    inject=_inject,
    exclusive=True,
    threshold=True,
)

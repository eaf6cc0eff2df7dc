"""A gear, or the coupling of the two units of a steering side, that twists under load."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from emulator.effects.base import Injector, Placed
from emulator.effects.injection import Injection
from emulator.effects.places import EACH_DRIVE, EACH_SIDE, STEERING


def _inject(injection: Injection, effect: Placed) -> Injection:
    more = effect.not_negative("compliance")
    if effect.where in STEERING:
        return injection.with_coupling(effect.where, lambda soft: replace(soft, compliance=soft.compliance + more))
    return injection.with_drive(effect.where, lambda flaws: replace(flaws, compliance=flaws.compliance + more))


INJECTOR: Final = Injector(
    name="elasticity",
    places=(*EACH_DRIVE, *EACH_SIDE),
    units={"compliance": "rad/Nm"},
    inject=_inject,
)

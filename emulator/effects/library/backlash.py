"""Play of a gear, or between the two units of a steering side."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from emulator.effects.base import Injector, Placed
from emulator.effects.injection import Injection
from emulator.effects.places import EACH_DRIVE, EACH_SIDE, STEERING


def _inject(injection: Injection, effect: Placed) -> Injection:
    more = effect.not_negative("gap")
    if effect.where in STEERING:
        return injection.with_coupling(effect.where, lambda soft: replace(soft, gap=soft.gap + more))
    return injection.with_drive(effect.where, lambda flaws: replace(flaws, gap=flaws.gap + more))


INJECTOR: Final = Injector(
    name="backlash",
    places=(*EACH_DRIVE, *EACH_SIDE),
    units={"gap": "rad"},
    inject=_inject,
)

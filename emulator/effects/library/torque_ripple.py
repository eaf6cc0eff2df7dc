"""Cogging of a motor."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from emulator.effects.base import Injector, Placed
from emulator.effects.drives import Ripple
from emulator.effects.injection import Injection
from emulator.effects.places import EACH_DRIVE


def _inject(injection: Injection, effect: Placed) -> Injection:
    ripple = Ripple(effect["amplitude"], effect["order"], effect["phase"])
    return injection.with_drive(effect.where, lambda flaws: replace(flaws, ripples=(*flaws.ripples, ripple)))


INJECTOR: Final = Injector(
    name="torque_ripple",
    places=EACH_DRIVE,
    units={"amplitude": "Nm", "order": "1", "phase": "rad"},
    inject=_inject,
)

"""A torque that a drive gives and does not report."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from emulator.effects.base import Injector, Placed
from emulator.effects.injection import Injection
from emulator.effects.places import EACH_DRIVE


def _inject(injection: Injection, effect: Placed) -> Injection:
    return injection.with_drive(effect.where, lambda flaws: replace(flaws, bias=flaws.bias + effect["bias"]))


INJECTOR: Final = Injector(
    name="torque_bias",
    places=EACH_DRIVE,
    units={"bias": "Nm"},
    inject=_inject,
    signed=True,
)

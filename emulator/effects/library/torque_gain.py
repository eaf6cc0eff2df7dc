"""A torque constant that is not the one that the drive reckons with."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from emulator.effects.base import Injector, Placed
from emulator.effects.injection import Injection
from emulator.effects.places import EACH_DRIVE


def _inject(injection: Injection, effect: Placed) -> Injection:
    return injection.with_drive(effect.where, lambda flaws: replace(flaws, gain=flaws.gain + effect["error"]))


INJECTOR: Final = Injector(
    name="torque_gain",
    places=EACH_DRIVE,
    units={"error": "1"},
    inject=_inject,
    signed=True,
)

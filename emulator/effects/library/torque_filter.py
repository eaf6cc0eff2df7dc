"""A drive whose torque follows the one that it reports as a filter of first order does."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from emulator.effects.base import Injector, Placed
from emulator.effects.injection import Injection
from emulator.effects.places import EACH_DRIVE
from ident.errors import UserError


def _inject(injection: Injection, effect: Placed) -> Injection:
    time = effect["time"]
    if time < 0:
        raise UserError(f"{effect}: nothing acts before its cause.", "Give a positive time.")
    return injection.with_drive(effect.where, lambda flaws: replace(flaws, lag=flaws.lag + time))


INJECTOR: Final = Injector(
    name="torque_filter",
    places=EACH_DRIVE,
    units={"time": "s"},
    inject=_inject,
)

"""A drive whose torque, or an encoder whose angle, comes later than it says."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from emulator.effects.base import Injector, Placed
from emulator.effects.injection import Injection
from emulator.effects.places import EACH_DRIVE, EACH_ENCODER, ENCODERS
from ident.errors import UserError


def _inject(injection: Injection, effect: Placed) -> Injection:
    delay = effect["delay"]
    if delay < 0:
        raise UserError(f"{effect}: nothing acts before its cause.", "Give a positive delay.")
    if effect.where in ENCODERS:
        return injection.with_encoder(effect.where, lambda flaws: replace(flaws, delay=flaws.delay + delay))
    return injection.with_drive(effect.where, lambda flaws: replace(flaws, delay=flaws.delay + delay))


INJECTOR: Final = Injector(
    name="time_delay",
    places=(*EACH_DRIVE, *EACH_ENCODER),
    units={"delay": "s"},
    inject=_inject,
    breaks_rolling=True,
)

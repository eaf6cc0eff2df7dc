"""A steering encoder whose zero is not straight ahead."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from emulator.effects.base import Injector, Placed
from emulator.effects.injection import Injection
from emulator.effects.places import EACH_SIDE


def _inject(injection: Injection, effect: Placed) -> Injection:
    return injection.with_encoder(effect.where, lambda flaws: replace(flaws, offset=flaws.offset + effect["offset"]))


INJECTOR: Final = Injector(
    name="steering_offset",
    places=EACH_SIDE,
    units={"offset": "rad"},
    inject=_inject,
    signed=True,
)

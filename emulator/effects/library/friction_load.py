"""Dry friction of a gear that grows with the torque it transmits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from emulator.effects.base import Injector, Placed
from emulator.effects.injection import Injection
from emulator.effects.laws import Moment
from emulator.effects.places import EACH_WHEEL, wheels_of
from ident.errors import UserError

_ROLLING: Final = 4


@dataclass(frozen=True)
class FrictionLoad:
    """Dry friction of a wheel that grows with the torque through its gear: share times its size [-]."""

    wheel: int
    share: float

    def __call__(self, moment: Moment) -> None:
        """Raise the friction."""
        moment.coulomb[_ROLLING + self.wheel] += self.share * abs(moment.drive_torques[self.wheel])


def _inject(injection: Injection, effect: Placed) -> Injection:
    share = effect["share"]
    if not 0 <= share < 1:
        raise UserError(
            f"{effect}: a gear that takes {share:g} of its load for friction either drives itself or never moves.",
            "Give a share from 0 to below 1.",
        )
    return injection.with_laws(*(FrictionLoad(wheel, share) for wheel in wheels_of(effect.where)))


INJECTOR: Final = Injector(
    name="friction_load",
    places=EACH_WHEEL,
    units={"share": "1"},
    inject=_inject,
)

"""Dry friction of a gear that grows with the torque it transmits. No model has it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from emulator.effects.base import Injector, laws
from emulator.effects.laws import Moment
from emulator.effects.places import wheels_of

_ROLLING: Final = 4


@dataclass(frozen=True)
class GearLoss:
    """Dry friction of a gear that grows with the torque it transmits: coefficient times its size [-]."""

    wheels: tuple[int, ...]
    coefficient: float

    def __call__(self, moment: Moment) -> None:
        """Raise the friction."""
        for wheel in self.wheels:
            moment.coulomb[_ROLLING + wheel] += self.coefficient * abs(moment.drive_torques[wheel])


INJECTOR: Final = Injector(
    name="gear_loss",
    places=("wheels",),
    units={"size": "1"},
    inject=laws(lambda _, effect: [GearLoss(wheels_of(effect.where), effect["size"])]),
    known=False,
    largest=0.08,
)

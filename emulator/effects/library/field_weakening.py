"""A torque constant that falls with speed. No model has it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from emulator.effects.base import Injector, laws
from emulator.effects.laws import Moment
from emulator.effects.places import wheels_of

_ROLLING: Final = 4


@dataclass(frozen=True)
class FieldWeakening:
    """A torque constant that falls with speed: coefficient times rate squared of the torque is missing [s^2/rad^2]."""

    wheels: tuple[int, ...]
    coefficient: float

    def __call__(self, moment: Moment) -> None:
        """Take off what is missing."""
        for wheel in self.wheels:
            rate = moment.rates[_ROLLING + wheel]
            moment.torques[_ROLLING + wheel] -= self.coefficient * rate**2 * moment.drive_torques[wheel]


INJECTOR: Final = Injector(
    name="field_weakening",
    places=("wheels",),
    units={"size": "s^2/rad^2"},
    inject=laws(lambda _, effect: [FieldWeakening(wheels_of(effect.where), effect["size"])]),
    known=False,
    largest=1e-3,
)

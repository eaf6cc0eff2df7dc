"""Friction with a long memory. No model has it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from emulator.effects.base import Injector, laws
from emulator.effects.laws import Moment
from emulator.effects.places import joint_axes


@dataclass
class Presliding:
    """Friction with a long memory: after a reversal it builds up over an angle (Dahl 1968) [Nm, rad].

    Attributes:
        joint: of the engine.
        torque: when it is built up.
        step: of the engine [s].
        angle: over which it builds up to 1 - 1/e.
    """

    joint: int
    torque: float
    step: float
    angle: float = 0.4
    _built: float = field(default=0.0, init=False)

    def __call__(self, moment: Moment) -> None:
        """Move on along the hysteresis, and add the torque."""
        turned = moment.rates[self.joint] * self.step
        self._built += (turned - abs(turned) * self._built) / self.angle
        moment.torques[self.joint] -= self.torque * self._built


INJECTOR: Final = Injector(
    name="presliding",
    places=("wheels",),
    units={"size": "Nm"},
    inject=laws(
        lambda injection, effect: [
            Presliding(axis.joint, effect["size"], injection.step) for axis in joint_axes(effect.where)
        ]
    ),
    known=False,
    largest=0.6,
)

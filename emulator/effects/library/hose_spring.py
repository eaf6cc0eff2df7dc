"""Hoses and cables to a steering unit that pull it to straight ahead. No model has it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from emulator.effects.base import Injector, at_joints
from emulator.effects.laws import Moment
from emulator.effects.places import STEERING, JointAxis


@dataclass(frozen=True)
class HoseSpring:
    """Hoses and cables to a steering unit that pull it to straight ahead [Nm/rad]."""

    axis: JointAxis
    stiffness: float

    def __call__(self, moment: Moment) -> None:
        """Add the torque."""
        angle = moment.angles[self.axis.joint]
        moment.torques[self.axis.joint] -= self.axis.share * self.stiffness * angle


INJECTOR: Final = Injector(
    name="hose_spring",
    places=STEERING,
    units={"size": "Nm/rad"},
    inject=at_joints(lambda axis, effect: HoseSpring(axis, effect["size"])),
    known=False,
    largest=6.0,
)

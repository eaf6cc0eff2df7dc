"""Dry friction that is higher at rest."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from emulator.effects.base import Injector, at_joints
from emulator.effects.laws import Moment
from emulator.effects.places import JOINTS, JointAxis


@dataclass(frozen=True)
class Stribeck:
    """Dry friction higher by amplitude exp(-(rate/velocity)^2) (Armstrong-Helouvry 1994, exponent 2).

    Attributes:
        axis: joint.
        amplitude: at rest [Nm].
        velocity: [rad/s].
    """

    axis: JointAxis
    amplitude: float
    velocity: float

    def __call__(self, moment: Moment) -> None:
        """Raise the limit of the joint's dry friction."""
        joint, share = self.axis.joint, self.axis.share
        moment.coulomb[joint] += share * self.amplitude * math.exp(-((moment.rates[joint] / self.velocity) ** 2))


INJECTOR: Final = Injector(
    name="stribeck",
    places=JOINTS,
    units={"amplitude": "Nm", "velocity": "rad/s"},
    inject=at_joints(lambda axis, effect: Stribeck(axis, effect["amplitude"], effect["velocity"])),
)

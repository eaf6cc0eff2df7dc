"""Dry friction that depends on the direction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from emulator.effects.base import Injector, Placed, at_joints, refuse_imbalance
from emulator.effects.injection import Injection
from emulator.effects.laws import Moment
from emulator.effects.places import JOINTS, JointAxis, friction_symbols


@dataclass(frozen=True)
class AsymmetricCoulomb:
    """Dry friction of d_c + imbalance forward and d_c - imbalance backward, at rest too.

    Friction between -(d_c + imbalance) and d_c - imbalance is symmetric friction under a constant torque -imbalance:
    it sticks for the same torques on the joint, and slides with the same.

    Attributes:
        axis: joint.
        imbalance: [Nm].
    """

    axis: JointAxis
    imbalance: float

    def __call__(self, moment: Moment) -> None:
        """Add the torque."""
        moment.torques[self.axis.joint] -= self.axis.sign * self.axis.share * self.imbalance


_laws = at_joints(lambda axis, effect: AsymmetricCoulomb(axis, effect["imbalance"]))


def _inject(injection: Injection, effect: Placed) -> Injection:
    _, symbol = friction_symbols(effect.where)
    refuse_imbalance(effect, injection.built.prototype.truth[symbol], "d_c")
    return _laws(injection, effect)


INJECTOR: Final = Injector(
    name="asymmetric_coulomb",
    places=JOINTS,
    units={"imbalance": "Nm"},
    inject=_inject,
    signed=True,
)

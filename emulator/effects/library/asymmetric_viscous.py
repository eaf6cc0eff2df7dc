"""Viscous friction that depends on the direction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from emulator.effects.base import Injector, Placed, at_joints, refuse_imbalance
from emulator.effects.injection import Injection
from emulator.effects.laws import Moment
from emulator.effects.places import JOINTS, JointAxis, friction_symbols


@dataclass(frozen=True)
class AsymmetricViscous:
    """Viscous friction of d_v + imbalance forward and d_v - imbalance backward [Nm s/rad]."""

    axis: JointAxis
    imbalance: float

    def __call__(self, moment: Moment) -> None:
        """Add the torque."""
        rate = abs(moment.rates[self.axis.joint])
        moment.torques[self.axis.joint] -= self.axis.sign * self.axis.share * self.imbalance * rate


_laws = at_joints(lambda axis, effect: AsymmetricViscous(axis, effect["imbalance"]))


def _inject(injection: Injection, effect: Placed) -> Injection:
    symbol, _ = friction_symbols(effect.where)
    refuse_imbalance(effect, injection.built.prototype.truth[symbol], "d_v")
    return _laws(injection, effect)


INJECTOR: Final = Injector(
    name="asymmetric_viscous",
    places=JOINTS,
    units={"imbalance": "Nm s/rad"},
    inject=_inject,
    signed=True,
)

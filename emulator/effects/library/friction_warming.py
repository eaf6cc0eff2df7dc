"""Friction that changes as a joint warms up, from the moment at which the emulated world starts."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from emulator.effects.base import Injector, Placed
from emulator.effects.injection import Injection
from emulator.effects.laws import Moment
from emulator.effects.places import JOINTS, JointAxis, friction_symbols, joint_axes
from ident.errors import UserError


@dataclass(frozen=True)
class FrictionWarming:
    """Viscous and dry friction times 1 + change (1 - exp(-t/time)).

    Attributes:
        axis: joint.
        viscous, coulomb: friction at its place when cold [Nm s/rad, Nm].
        change: share of both that has come in the end.
        time: constant of the warming [s].
    """

    axis: JointAxis
    viscous: float
    coulomb: float
    change: float
    time: float

    def __call__(self, moment: Moment) -> None:
        """Add to both frictions."""
        joint, share = self.axis.joint, -self.change * math.expm1(-moment.time / self.time) * self.axis.share
        moment.coulomb[joint] += share * self.coulomb
        moment.torques[joint] -= share * self.viscous * moment.rates[joint]


def _inject(injection: Injection, effect: Placed) -> Injection:
    change, time, truth = effect["change"], effect["time"], injection.built.prototype.truth
    if change <= -1 or time <= 0:
        raise UserError(
            f"{effect}: friction stays positive, and changes in some time.", "Give a change above -1, a time above 0."
        )
    viscous, coulomb = (truth[symbol] for symbol in friction_symbols(effect.where))
    return injection.with_laws(
        *(FrictionWarming(axis, viscous, coulomb, change, time) for axis in joint_axes(effect.where))
    )


INJECTOR: Final = Injector(
    name="friction_warming",
    places=JOINTS,
    units={"change": "1", "time": "s"},
    inject=_inject,
    signed=True,
)

"""Dry friction of the steering that grows from one end of its travel to the other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from emulator.effects.base import Injector, Placed
from emulator.effects.injection import Injection
from emulator.effects.laws import Moment
from emulator.effects.places import EACH_SIDE, JointAxis, friction_symbols, joint_axes
from ident.errors import UserError

REACH: Final = 1.0
"""Steering angle up to which dry friction has to stay positive [rad]; beyond, where it is all gone, none is left."""


@dataclass(frozen=True)
class FrictionPosition:
    """Limit of dry friction raised by slope times the steering angle.

    Attributes:
        axis: joint.
        slope: of a whole side [Nm/rad].
    """

    axis: JointAxis
    slope: float

    def __call__(self, moment: Moment) -> None:
        """Raise the limit, or lower it to nothing."""
        joint = self.axis.joint
        more = self.axis.share * self.slope * self.axis.sign * moment.angles[joint]
        moment.coulomb[joint] = max(moment.coulomb[joint] + more, 0.0)


def _inject(injection: Injection, effect: Placed) -> Injection:
    slope, symbol = effect["slope"], friction_symbols(effect.where)[1]
    own = injection.built.prototype.truth[symbol]
    if abs(slope) * REACH > own:
        raise UserError(
            f"{effect}: {slope:g} Nm/rad is more than the dry friction has to lose within {REACH:g} rad.",
            f"Stay below {own / REACH:g} Nm/rad: {symbol} is {own:g} Nm.",
        )
    return injection.with_laws(*(FrictionPosition(axis, slope) for axis in joint_axes(effect.where)))


INJECTOR: Final = Injector(
    name="friction_position",
    places=EACH_SIDE,
    units={"slope": "Nm/rad"},
    inject=_inject,
    signed=True,
)

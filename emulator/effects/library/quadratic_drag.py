"""Resistance that grows with the square of the speed, of wheels or of the whole vehicle."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from emulator.effects.base import Injector, Placed, at_joints
from emulator.effects.injection import Injection
from emulator.effects.laws import Moment
from emulator.effects.places import CHASSIS, EACH_WHEEL, JointAxis


@dataclass(frozen=True)
class QuadraticJointDrag:
    """A torque of -coefficient times rate abs(rate) [Nm s^2/rad^2]."""

    axis: JointAxis
    coefficient: float

    def __call__(self, moment: Moment) -> None:
        """Add the torque."""
        rate = moment.rates[self.axis.joint]
        moment.torques[self.axis.joint] -= self.coefficient * rate * abs(rate)


@dataclass(frozen=True)
class QuadraticChassisDrag:
    """A force of -coefficient times v abs(v) on the chassis, against its velocity over the floor [N s^2/m^2]."""

    coefficient: float

    def __call__(self, moment: Moment) -> None:
        """Push the chassis."""
        forward, left, _ = moment.engine.twist()
        resistance = -self.coefficient * math.hypot(forward, left)
        moment.engine.push((resistance * forward, resistance * left, 0.0))


_at_wheels = at_joints(lambda axis, effect: QuadraticJointDrag(axis, effect["coefficient"]))


def _inject(injection: Injection, effect: Placed) -> Injection:
    if effect.where in CHASSIS:
        return injection.with_laws(QuadraticChassisDrag(effect["coefficient"]))
    return _at_wheels(injection, effect)


INJECTOR: Final = Injector(
    name="quadratic_drag",
    places=(*EACH_WHEEL, *CHASSIS),
    units={"coefficient": "Nm s^2/rad^2"},
    inject=_inject,
    units_at={"chassis": "N s^2/m^2"},
)

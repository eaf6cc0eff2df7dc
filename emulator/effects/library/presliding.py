"""Friction that bends bristles before it slides: after a reversal it builds up over an angle."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final

from emulator.effects.base import Injector, Placed
from emulator.effects.injection import Injection
from emulator.effects.laws import Moment
from emulator.effects.places import JOINTS, JointAxis, joint_axes
from ident.errors import UserError

_STIFFEST: Final = 1.0
"""Stiffness of the bristles times step^2 over inertia that they may have; explicit integration takes 4."""


@dataclass
class Presliding:
    """Friction with a memory (Dahl 1968): torque times a state that goes to 1 or -1 with the way [Nm, rad].

    Attributes:
        axis: joint.
        torque: when it is built up, of a whole side.
        angle: over which it builds up to 1 - 1/e.
        step: of the engine [s].
    """

    axis: JointAxis
    torque: float
    angle: float
    step: float
    _built: float = field(default=0.0, init=False)

    def __call__(self, moment: Moment) -> None:
        """Move on along the hysteresis, and add the torque."""
        joint = self.axis.joint
        turned = moment.rates[joint] * self.step
        towards = math.copysign(1.0, turned)
        self._built += (towards - self._built) * -math.expm1(-abs(turned) / self.angle)
        moment.torques[joint] -= self.axis.share * self.torque * self._built


def _inject(injection: Injection, effect: Placed) -> Injection:
    torque, angle, step = effect["amplitude"], effect["angle"], injection.step
    if torque < 0 or angle <= 0:
        raise UserError(
            f"{effect}: bristles resist, and bend over some angle.", "Give an amplitude and an angle above zero."
        )
    truth = injection.built.prototype.truth
    inertia = {"steering_left": truth["C_l"], "steering_right": truth["C_r"]}.get(effect.where, truth["B_w"])
    shortest = torque * step**2 / (_STIFFEST * inertia)
    if angle < shortest:
        raise UserError(
            f"{effect}: bristles that bend over {angle:g} rad are stiffer than a step of {step:g} s resolves.",
            f"Give an angle of at least {shortest:.2g} rad, or less amplitude.",
        )
    return injection.with_laws(*(Presliding(axis, torque, angle, step) for axis in joint_axes(effect.where)))


INJECTOR: Final = Injector(
    name="presliding",
    places=JOINTS,
    units={"amplitude": "Nm", "angle": "rad"},
    inject=_inject,
)

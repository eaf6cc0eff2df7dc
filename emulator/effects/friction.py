"""Friction beyond viscous and Coulomb: Stribeck, dependence on direction, drag growing with the square of speed."""

from __future__ import annotations

import math
from dataclasses import dataclass

from emulator.effects.laws import JointAxis, Moment


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


@dataclass(frozen=True)
class AsymmetricViscous:
    """Viscous friction of d_v + imbalance forward and d_v - imbalance backward [Nm s/rad]."""

    axis: JointAxis
    imbalance: float

    def __call__(self, moment: Moment) -> None:
        """Add the torque."""
        rate = abs(moment.rates[self.axis.joint])
        moment.torques[self.axis.joint] -= self.axis.sign * self.axis.share * self.imbalance * rate


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

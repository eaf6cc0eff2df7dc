"""Gears and couplings that give way: a spring with play, and a motor that turns on its own."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from emulator.as_built import SoftCoupling
from emulator.effects.laws import Moment
from ident.errors import UserError

DAMPING_RATIO: Final = 0.05
"""Of the free vibration of two equal masses on the spring; a steel gear's order of magnitude."""

MOTOR_SHARE: Final = 0.5
"""Share of B_w on the motor's side of a flexible gear: motor inertia matched to its load."""

_STIFFEST: Final = 1.5
"""Stiffness times step^2 over inertia of either side that a spring may have; explicit integration takes 2."""

_CONTACT: Final = 0.3
"""The same of the contact at the end of a play."""


@dataclass(frozen=True)
class SpringWithPlay:
    """Torque over twist: nothing inside the gap, a damped spring outside.

    Attributes:
        stiffness: [Nm/rad].
        damping: [Nm s/rad].
        gap: whole play [rad].
    """

    stiffness: float
    damping: float
    gap: float

    def torque(self, twist: float, rate: float) -> float:
        """Torque [Nm] of a twist [rad] and its rate [rad/s]; a contact pushes, it never pulls."""
        if not self.gap:
            return self.stiffness * twist + self.damping * rate
        half = self.gap / 2
        if twist > half:
            return max(self.stiffness * (twist - half) + self.damping * rate, 0.0)
        if twist < -half:
            return min(self.stiffness * (twist + half) + self.damping * rate, 0.0)
        return 0.0


def make_spring(compliance: float, gap: float, inertia: float, step: float, place: str) -> SpringWithPlay:
    """The spring of a compliance; where there is play alone, as stiff as the step resolves well.

    Args:
        compliance: twist per torque, zero for play alone [rad/Nm].
        gap: whole play [rad].
        inertia: of either side [kg m^2].
        step: of the engine [s].
        place: for messages.

    Raises:
        UserError: the spring is stiffer than the step resolves.
    """
    stiffest = _STIFFEST * inertia / step**2
    stiffness = 1 / compliance if compliance else _CONTACT * inertia / step**2
    if stiffness > stiffest:
        raise UserError(
            f"A compliance of {compliance:g} rad/Nm at {place} is stiffer than a step of {step:g} s resolves.",
            f"Give at least {1 / stiffest:.2g} rad/Nm, or leave it out.",
        )
    return SpringWithPlay(stiffness, 2 * DAMPING_RATIO * math.sqrt(stiffness * inertia / 2), gap)


class FlexibleGear:
    """The motor of one wheel on its own side of a flexible gear, in coordinates of the wheel.

    It integrates as the engine does: rates in the middle of a step, angles at its end. So momentum is kept.

    Args:
        spring: of the gear.
        inertia: of the motor with its side of the gear, times the gear ratio squared [kg m^2].
        step: of the engine [s].
    """

    def __init__(self, spring: SpringWithPlay, inertia: float, step: float) -> None:
        self._spring = spring
        self._inertia = inertia
        self._step = step
        self.angle = self.rate = self._previous_rate = 0.0

    def rest_at(self, angle: float) -> None:
        """At rest, in the middle of the play."""
        self.angle, self.rate, self._previous_rate = angle, 0.0, 0.0

    def wheel_angle_under(self, angle: float, torque: float) -> float:
        """Where the wheel is while the motor at `angle` [rad] presses on it with `torque` [Nm], both moving alike."""
        play = math.copysign(self._spring.gap / 2, torque) if torque else 0.0
        return angle - torque / self._spring.stiffness - play

    def move_on(self, angle: float, rate: float) -> None:
        """The motor moves at this rate [rad/s], as it has done over the last step."""
        self.angle, self.rate, self._previous_rate = angle, rate, rate

    @property
    def rate_now(self) -> float:
        """Rate at the end of the last step [rad/s], extrapolated to second order."""
        return 1.5 * self.rate - 0.5 * self._previous_rate

    def advance(self, motor_torque: float, wheel_angle: float, wheel_rate: float) -> float:
        """One step under `motor_torque`; gives the torque on the wheel in it [Nm]."""
        torque = self._spring.torque(self.angle - wheel_angle, self.rate_now - wheel_rate)
        self._previous_rate = self.rate
        self.rate += self._step * (motor_torque - torque) / self._inertia
        self.angle += self._step * self.rate
        return torque


@dataclass(frozen=True)
class CouplingTorque:
    """The soft coupling of one side: what front and rear unit deviate from turning against each other.

    Attributes:
        front: joint of the front unit; the rear one is the next.
        spring: of the coupling.
    """

    front: int
    spring: SpringWithPlay

    def __call__(self, moment: Moment) -> None:
        """Add the torque to both units."""
        front, rear = self.front, self.front + 1
        twist = moment.angles[front] + moment.angles[rear]
        torque = self.spring.torque(twist, moment.rates[front] + moment.rates[rear])
        moment.torques[front] -= torque
        moment.torques[rear] -= torque


def coupling_torque(side: int, coupling: SoftCoupling, inertia: float, step: float) -> CouplingTorque:
    """The law of a soft coupling.

    Args:
        side: 0 left, 1 right.
        coupling: its compliance and play.
        inertia: of one steering unit about its axis [kg m^2].
        step: of the engine [s].

    Raises:
        UserError: it is stiffer than the step resolves.
    """
    place = ("steering_left", "steering_right")[side]
    return CouplingTorque(2 * side, make_spring(coupling.compliance, coupling.gap, inertia, step, place))

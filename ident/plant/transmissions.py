"""Gears and couplings that give way: a spring with play between motor and wheel, or between two steering units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca

from ident.plant.places import DRIVES, STEERING
from ident.plant.springs import DAMPING_RATIO, MOTOR_SHARE, STIFFEST, damping_of, spring_torque, stiffness_of
from ident.plant.symbolic import LENGTHS, Expression
from ident.plant.terms import Term, compliance_at, gap_at
from ident.vehicle.parameters import PARAMETER_NAMES


@dataclass(frozen=True)
class Spring:
    """A gear, or the coupling of a steering side, that gives way.

    Attributes:
        is_gear: whether it is a gear.
        place: 0 to 3 for the wheels fl, rl, fr, rr; 0 and 1 for the sides left, right.
        compliance: zero where there is play alone [rad/Nm].
        gap: whole play [rad].
    """

    is_gear: bool
    place: int
    compliance: float
    gap: float


def springs_of(terms: Sequence[Term]) -> tuple[Spring, ...]:
    """What gives way: gears, then couplings, of which an addition with numbers says a compliance or play."""
    found = []
    for places in (DRIVES, STEERING):
        for index, place in enumerate(places):
            compliance, gap = float(compliance_at(terms, place)), float(gap_at(terms, place))
            if compliance or gap:
                found.append(Spring(places is DRIVES, index, compliance, gap))
    return tuple(found)


@dataclass(frozen=True)
class SpringNumbers:
    """What nobody says of a single spring.

    Attributes:
        stiffest: stiffness of what has play alone [Nm/rad].
        damping_ratio: of the free vibration of both sides.
        motor_share: part of B_w on the motor's side of a flexible gear.
    """

    stiffest: Expression = STIFFEST
    damping_ratio: Expression = DAMPING_RATIO
    motor_share: Expression = MOTOR_SHARE


@dataclass(frozen=True)
class Twist:
    """A gear or coupling that gives way.

    Attributes:
        place: 0 to 3 for the gears of fl, rl, fr, rr; 0 and 1 for the couplings left and right.
        angle, rate, acceleration: of a motor over its wheel; of a front unit over its rear unit, whose angle is taken
            with its sign turned [rad, rad/s, rad/s²].
        inertia: of the motor, at the wheel, or of one unit about its axis [kg m²].
        stiffness, gap, damping: of the spring [Nm/rad, rad, Nm s/rad].
    """

    place: int
    angle: Expression
    rate: Expression
    acceleration: Expression
    inertia: Expression
    stiffness: Expression
    gap: Expression
    damping: Expression

    @property
    def torque(self) -> Expression:
        """That turns both sides back [Nm]."""
        return spring_torque(self.angle, self.rate, self.stiffness, self.gap, self.damping)


Motion = tuple[Expression, Expression, Expression]
"""Angle, rate and acceleration of a twist."""


def gear(wheel: int, motion: Motion, terms: Sequence[Term], parameters: Expression, numbers: SpringNumbers) -> Twist:
    """The gear of a wheel; from the parameters p′ (11,)."""
    motor = numbers.motor_share * parameters[PARAMETER_NAMES.index("B_w")]
    return _twist(wheel, DRIVES[wheel], motion, motor, (1 - numbers.motor_share) * motor, terms, numbers)


def coupling(side: int, motion: Motion, terms: Sequence[Term], parameters: Expression, numbers: SpringNumbers) -> Twist:
    """The coupling of a side; from the parameters p′ (11,)."""
    unit = parameters[PARAMETER_NAMES.index(("C_l", "C_r")[side])] / 2
    return _twist(side, STEERING[side], motion, unit, unit / 2, terms, numbers)


def _twist(
    index: int,
    place: str,
    motion: Motion,
    inertia: Expression,
    reduced_inertia: Expression,
    terms: Sequence[Term],
    numbers: SpringNumbers,
) -> Twist:
    stiffness = stiffness_of(compliance_at(terms, place), numbers.stiffest)
    damping = damping_of(stiffness, reduced_inertia, numbers.damping_ratio)
    return Twist(index, *motion, inertia, stiffness, gap_at(terms, place), damping)


def at_motors(gears: Sequence[Twist], wheels: Expression, name: str) -> Expression:
    """Angles or rates (4,) of the motors, at the wheel, from those of the wheels; `name` is `angle` or `rate`."""
    motors = ca.SX(wheels)
    for twisted in gears:
        motors[twisted.place] += getattr(twisted, name)
    return motors


def motor_inertial(twisted: Twist, wheel_acceleration: Expression) -> Expression:
    """What of the torque at a motor's shaft its spring does not take, at the wheel [Nm]: B_m (β̈ + φ̈)."""
    return twisted.inertia * (wheel_acceleration + twisted.acceleration)


def twist_acceleration(twisted: Twist, shaft: Expression, wheel_acceleration: Expression) -> Expression:
    """φ̈ [rad/s²] under the torque at the motor's shaft [Nm]: B_m (β̈ + φ̈) + K = i_G u′."""
    return (LENGTHS.i_G * shaft - twisted.torque) / twisted.inertia - wheel_acceleration


def transmitted_torques(gears: Sequence[Twist], shaft_torques: Expression) -> Expression:
    """Torques (4,) that reach the wheels, over the gear ratio [Nm]."""
    transmitted = ca.SX(shaft_torques)
    for twisted in gears:
        transmitted[twisted.place] = twisted.torque / LENGTHS.i_G
    return transmitted

"""The equations of one mode with gears and couplings that give way.

To the generalized velocities ṡ_k of a mode come the rates of the twists. With motors at the angles β + φ and rear units
at -α + t, both twists being forces' only business, the rows of (19) hold with

    ṡ_k   H_kᵀ (Θ p′ + f - B u′) as ever, B_m φ̈ more at the wheel, what the rear unit does by t at its steering axis
    φ     B_m (β̈ + φ̈) + K(φ, φ̇) = i_G u′
    t     C/2 (γ̈ - α̈ + ẗ) + its half of the friction + K(t, ṫ) = what the force of its wheel does on the lever a

B_m is the motor's part of B_w and stays in β's own inertia, for a motor moves with β. Friction of a drive acts at the
wheel. Scrub and the mass of the units take both units as turning alike. What t does to the directions in which the rear
wheel rolls is left out, except where it steers at standstill: it is of the order t, and a wheel that is askew slides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ident.vehicle import symbolic
from ident.vehicle.effect_terms import (
    EffectTerm,
    State,
    added_forces,
    changed_parameters,
    on_radii,
    rolling_radii,
    shaft_torques,
)
from ident.vehicle.effects import EffectName
from ident.vehicle.kinematics import GENERALIZED_VELOCITIES
from ident.vehicle.modes import Mode
from ident.vehicle.parameters import PARAMETER_NAMES
from ident.vehicle.springs import MOTOR_SHARE, damping_of, resting_twist, spring_torque, stiffness_of
from ident.vehicle.symbolic import LENGTHS, Expression

_OF_UNITS: Final = (EffectName.SCRUB, EffectName.STEERING_UNIT_MASS)
"""What the chassis feels of front and rear unit in different ways."""

_WHEELS: Final = 5
"""Row of q of the first wheel."""


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


@dataclass(frozen=True)
class Point:
    """Where the vehicle is and how it moves, symbols.

    Attributes:
        angles: γ, α, β (7,).
        twist: of the springs (n,).
        velocity: ṡ_k, then the rates of the twists (n_k + n,).
    """

    angles: Expression
    twist: Expression
    velocity: Expression


class FlexibleModel:
    """A mode of a vehicle with effects and springs.

    Args:
        mode: k.
        terms: effects of the equations.
        springs: what gives way.

    Attributes:
        twists: n, number of springs.
        width: n_k + n.
    """

    def __init__(self, mode: Mode, terms: Sequence[EffectTerm], springs: Sequence[Spring]) -> None:
        self._mode, self._terms, self._springs = mode, list(terms), list(springs)
        self.twists = len(springs)
        self.width = len(GENERALIZED_VELOCITIES[mode]) + self.twists

    def motor_columns(self) -> NDArray[np.float64]:
        """What the twists add to the angles of the motors (4, n)."""
        columns = np.zeros((4, self.twists))
        for column, spring in enumerate(self._springs):
            if spring.is_gear:
                columns[spring.place, column] = 1.0
        return columns

    def directions(self, angles: Expression) -> Expression:
        """From velocities to q̇ (9, n_k + n)."""
        radii = rolling_radii(self._terms, angles[3:])
        columns = ca.SX.zeros(9, self.twists)
        for column, spring in enumerate(self._springs):
            if not spring.is_gear:
                rear = 2 * spring.place + 1
                columns[_WHEELS + rear, column] = -LENGTHS.a * symbolic.CORNERS[rear][1] / radii[rear]
        return ca.horzcat(on_radii(symbolic.complement(self._mode, angles[1:3]), radii), columns)

    def rates(self, angles: Expression, velocity: Expression) -> Expression:
        """q̇ (9,)."""
        return self.directions(angles) @ velocity

    def reading(self, angles: Expression) -> Expression:
        """From velocities to α̇ of the front units and the rates of the motors (6, n_k + n)."""
        plain = ca.SX.zeros(6, self.width - self.twists)
        motors = ca.vertcat(ca.SX.zeros(2, self.twists), ca.SX(self.motor_columns()))
        return self.directions(angles)[3:, :] + ca.horzcat(plain, motors)

    def acceleration(self, point: Point, u: Expression, p: Expression) -> Expression:
        """Derivative of the velocity (n_k + n,) under reported torques u (4,), for p (11,)."""
        parameters = changed_parameters(self._terms, p)
        torques = [
            spring_torque(point.twist[index], point.velocity[self.width - self.twists + index], *numbers)
            for index, numbers in enumerate(self._numbers(parameters))
        ]
        unknown = ca.SX.sym("a", self.width)
        return _solved(self._balance(point, unknown, u, p) + self._in_rows(torques), unknown)

    def resting(
        self, angles: Expression, velocity: Expression, u: Expression, p: Expression
    ) -> tuple[Expression, Expression, Expression]:
        """A motion in which nothing swings: twists (n,) under its load, how late the dampers keep them [s], s̈_k."""
        plain = self.width - self.twists
        still = ca.SX.zeros(self.twists)
        acceleration = ca.SX.sym("a", plain)
        point = Point(angles, still, ca.vertcat(velocity, still))
        balance = self._balance(point, ca.vertcat(acceleration, still), u, p)
        found = _solved(balance[:plain], acceleration)
        loads = -ca.substitute(balance[plain:], acceleration, found)
        numbers = self._numbers(changed_parameters(self._terms, p))
        twists = [resting_twist(loads[index], stiffness, gap) for index, (stiffness, gap, _) in enumerate(numbers)]
        lags = [damping / stiffness for stiffness, _, damping in numbers]
        return ca.vertcat(*twists), ca.vertcat(*lags), found

    def _numbers(self, parameters: Expression) -> list[tuple[Expression, Expression, Expression]]:
        """Stiffness, gap and damping of every spring."""
        found = []
        for spring in self._springs:
            stiffness = stiffness_of(spring.compliance)
            inertia = _own_inertia(spring, parameters)
            reduced = (1 - MOTOR_SHARE) * inertia if spring.is_gear else inertia / 2
            found.append((stiffness, ca.SX(spring.gap), damping_of(stiffness, reduced)))
        return found

    def _in_rows(self, torques: Sequence[Expression]) -> Expression:
        return ca.vertcat(ca.SX.zeros(self.width - self.twists), *torques)

    def _balance(self, point: Point, unknown: Expression, u: Expression, p: Expression) -> Expression:
        """Generalized forces (n_k + n,) that must be zero together with those of the springs."""
        parameters, plain = changed_parameters(self._terms, p), self.width - self.twists
        H = self.directions(point.angles)
        rates = H @ point.velocity
        accelerations = ca.jtimes(rates, point.angles, rates[2:]) + H @ unknown
        state = State(point.angles[0], point.angles[1:3], point.angles[3:], rates, accelerations)
        motors = state.beta + ca.SX(self.motor_columns()) @ point.twist
        driving = symbolic.input_matrix() @ shaft_torques(self._terms, u, motors)
        resisting = _resistance(self._terms, state, parameters, p)
        rows = []
        for index, spring in enumerate(self._springs):
            rate, change = point.velocity[plain + index], unknown[plain + index]
            inertia = _own_inertia(spring, parameters)
            if spring.is_gear:
                row = _WHEELS + spring.place
                rows.append(inertia * (accelerations[row] + change) - driving[row])
                resisting[row] += inertia * change
            else:
                front, rear = self._units(spring, state, rate, change, parameters, p)
                rows.append(inertia * accelerations[2] - rear)
                resisting[2] += inertia * change
                resisting[3 + spring.place] += rear - front
        balance = H.T @ (resisting - driving)
        return balance + ca.vertcat(ca.SX.zeros(plain), *rows)

    def _units(
        self, spring: Spring, state: State, rate: Expression, change: Expression, parameters: Expression, p: Expression
    ) -> tuple[Expression, Expression]:
        """What front and rear unit of a side resist, about their steering axes [Nm]."""
        row = 3 + spring.place
        rates, accelerations = ca.SX(state.rates), ca.SX(state.accelerations)
        rates[row] -= rate
        accelerations[row] -= change
        alike = [term for term in self._terms if term.name not in _OF_UNITS]
        rear = replace(state, rates=rates, accelerations=accelerations)
        front, back = (_resistance(alike, each, parameters, p)[row] / 2 for each in (state, rear))
        return front, back


def _resistance(terms: Sequence[EffectTerm], state: State, parameters: Expression, p: Expression) -> Expression:
    """Θ p′ + f (9,)."""
    return symbolic.regressor(state.rates, state.accelerations) @ parameters + added_forces(terms, state, p)


def _own_inertia(spring: Spring, parameters: Expression) -> Expression:
    """Of a motor behind its gear, or of one unit of a side [kg m²]."""
    if spring.is_gear:
        return MOTOR_SHARE * parameters[PARAMETER_NAMES.index("B_w")]
    return parameters[PARAMETER_NAMES.index(("C_l", "C_r")[spring.place])] / 2


def _solved(balance: Expression, unknown: Expression) -> Expression:
    """The unknown accelerations, in which the balance is linear."""
    rest = ca.substitute(balance, unknown, ca.SX.zeros(unknown.numel()))
    return ca.solve(-ca.jacobian(balance, unknown), rest)

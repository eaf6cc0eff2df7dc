"""The balance of forces closed by wheels that roll: the equations of one mode, gears and couplings giving way or not.

To the generalized velocities ṡ_k of a mode come the rates of the twists. With motors at the angles β + φ and rear units
at -α + t, both twists being forces' only business, the rows of (19) hold with

    ṡ_k   H_kᵀ (Θ p′ + f - B u′) as ever, B_m φ̈ more at the wheel, what the rear unit does by t at its steering axis
    φ     B_m (β̈ + φ̈) + K(φ, φ̇) = i_G u′
    t     C/2 (γ̈ - α̈ + ẗ) + its half of the friction + K(t, ṫ) = what the force of its wheel does on the lever a

B_m is the motor's part of B_w and stays in β's own inertia, for a motor moves with β. Friction of a drive acts at the
wheel. What t does to the directions in which the rear wheel rolls is left out, except where it steers at standstill: it
is of the order t, and a wheel that is askew slides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ident.plant import symbolic
from ident.plant.balance import Resistance
from ident.plant.bristles import bent_on, bristles_of
from ident.plant.kinematics import GENERALIZED_VELOCITIES
from ident.plant.modes import Mode
from ident.plant.springs import resting_twist
from ident.plant.symbolic import LENGTHS, Expression
from ident.plant.terms import FIRST_WHEEL, State, Term, changed_parameters, on_radii, rolling_radii, shaft_torques
from ident.plant.transmissions import (
    Spring,
    SpringNumbers,
    Twist,
    at_motors,
    coupling,
    gear,
    motor_inertial,
    transmitted_torques,
)


@dataclass(frozen=True)
class Point:
    """Where the vehicle is and how it moves, symbols.

    Attributes:
        angles: γ, α, β (7,).
        twist: of the springs (n,).
        velocity: ṡ_k, then the rates of the twists (n_k + n,).
        elapsed: time since the start of the campaign [s].
        bent: how far the bristles of joints are bent (m,).
    """

    angles: Expression
    twist: Expression
    velocity: Expression
    elapsed: Expression
    bent: Expression


class RollingModel:
    """A mode of a vehicle with effects and springs.

    Args:
        mode: k.
        terms: effects of the equations.
        springs: what gives way.

    Attributes:
        twists: n, number of springs.
        width: n_k + n.
        bristles: m joints whose friction bends bristles, with the angle θ of each.
    """

    def __init__(self, mode: Mode, terms: Sequence[Term], springs: Sequence[Spring]) -> None:
        self._mode, self._terms, self._springs = mode, list(terms), list(springs)
        self.twists = len(springs)
        self.bristles = bristles_of(terms)
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
                columns[FIRST_WHEEL + rear, column] = -LENGTHS.a * symbolic.CORNERS[rear][1] / radii[rear]
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
        unknown = ca.SX.sym("a", self.width)
        balance, twists = self._balance(point, unknown, u, p)
        return _solved(balance + self._in_rows([twist.torque for twist in twists]), unknown)

    def bent_on(self, point: Point, time: Expression) -> Expression:
        """How far the bristles are bent (m,) after a time [s] at these velocities."""
        rates = self.rates(point.angles, point.velocity)
        found = [
            bent_on(bent, time * rates[row], angle)
            for bent, ((_, row), angle) in zip(ca.vertsplit(point.bent), self.bristles.items(), strict=True)
        ]
        return ca.vertcat(*found)

    def resting(self, point: Point, u: Expression, p: Expression) -> tuple[Expression, Expression, Expression]:
        """A motion in which nothing swings: twists (n,) under its load, how late the dampers keep them [s], s̈_k.

        Args:
            point: without twists, nor rates of them.
            u: reported torques (4,) [Nm].
            p: (11,).
        """
        plain = self.width - self.twists
        acceleration = ca.SX.sym("a", plain)
        unknown = ca.vertcat(acceleration, ca.SX.zeros(self.twists))
        balance, twists = self._balance(point, unknown, u, p, resting=True)
        found = _solved(balance[:plain], acceleration)
        loads = -ca.substitute(balance[plain:], acceleration, found)
        angles = [resting_twist(loads[index], twist.stiffness, twist.gap) for index, twist in enumerate(twists)]
        lags = [twist.damping / twist.stiffness for twist in twists]
        return ca.vertcat(*angles), ca.vertcat(*lags), found

    def _in_rows(self, torques: Sequence[Expression]) -> Expression:
        return ca.vertcat(ca.SX.zeros(self.width - self.twists), *torques)

    def _balance(
        self, point: Point, unknown: Expression, u: Expression, p: Expression, *, resting: bool = False
    ) -> tuple[Expression, list[Twist]]:
        """Generalized forces (n_k + n,) that must be zero together with those of the springs, and the springs.

        Gears transmit what their springs give, or, where these are what is asked for, what the motors do.
        """
        H, state = self.directions(point.angles), self._state(point, unknown)
        parameters = changed_parameters(self._terms, p, state)
        gears, couplings = self._twists(point, unknown, parameters)
        shaft = shaft_torques(self._terms, u, at_motors(gears, state.beta, "angle"))
        transmitted = transmitted_torques([] if resting else gears, shaft)
        state = replace(state, loads=LENGTHS.i_G * transmitted)
        resisting = Resistance(self._terms, parameters).at(state, None, couplings)
        whole = resisting[:9] - symbolic.input_matrix() @ shaft
        motors = []
        for twist in gears:
            row = FIRST_WHEEL + twist.place
            whole[row] += twist.inertia * twist.acceleration
            motors.append(motor_inertial(twist, state.accelerations[row]) - LENGTHS.i_G * shaft[twist.place])
        return H.T @ whole + self._in_rows([*motors, resisting[9:]]), [*gears, *couplings]

    def _twists(self, point: Point, unknown: Expression, parameters: Expression) -> tuple[list[Twist], list[Twist]]:
        """Gears, then couplings, in the order of the springs."""
        plain = self.width - self.twists
        found: dict[bool, list[Twist]] = {True: [], False: []}
        for index, spring in enumerate(self._springs):
            motion = point.twist[index], point.velocity[plain + index], unknown[plain + index]
            make = gear if spring.is_gear else coupling
            found[spring.is_gear].append(make(spring.place, motion, self._terms, parameters, SpringNumbers()))
        return found[True], found[False]

    def _state(self, point: Point, unknown: Expression) -> State:
        """At accelerations (n_k + n,)."""
        H = self.directions(point.angles)
        rates = H @ point.velocity
        accelerations = ca.jtimes(rates, point.angles, rates[2:]) + H @ unknown
        bent = dict(zip(self.bristles, ca.vertsplit(point.bent), strict=True))
        angles = point.angles
        return State(angles[0], angles[1:3], angles[3:], rates, accelerations, point.elapsed, bent=bent)


def _solved(balance: Expression, unknown: Expression) -> Expression:
    """The unknown accelerations, in which the balance is linear."""
    rest = ca.substitute(balance, unknown, ca.SX.zeros(unknown.numel()))
    return ca.solve(-ca.jacobian(balance, unknown), rest)

"""Wheel units whose mass is not on their steering axes."""

from __future__ import annotations

from typing import ClassVar, Final

import casadi as ca

from ident.effects.base import EffectKind, EffectParameter, EffectTerm, Sign
from ident.plant.places import CHASSIS
from ident.plant.symbolic import CORNERS, LENGTHS, Expression
from ident.plant.terms import Masses, State, acceleration_at, cross, left_of


class _SteeringUnitMass(EffectTerm):
    of_both_units: ClassVar[bool] = True

    def forces(self, state: State, masses: Masses, parameters: Expression) -> Expression:
        """First-moment coupling of four point masses at the wheel contacts.

        The masses themselves are part of m_ch, and their inertias about the steering axes of C_l, C_r and C_ch; what is
        left is the difference between a mass at the contact and the same mass at the axis, less that inertia.
        """
        del masses, parameters
        rows = ca.SX.zeros(9)
        for front, side in CORNERS:
            column = 3 if side > 0 else 4
            axis = ca.vertcat(front * LENGTHS.l / 2, side * LENGTHS.b / 2)
            delta, turn = front * state.alpha[column - 3], state.rates[2] + front * state.rates[column]
            arm = LENGTHS.a * side * ca.vertcat(-ca.sin(delta), ca.cos(delta))
            turning = state.accelerations[2] + front * state.accelerations[column]
            carried = turning * left_of(arm) - turn**2 * arm
            about_axis = cross(arm, acceleration_at(axis, state))
            rows[:2] += carried
            rows[2] += cross(axis, carried) + about_axis
            rows[column] += front * about_axis
        return self["mass"] * rows


EFFECT: Final = EffectKind(
    name="steering_unit_mass",
    rank=190,
    places=CHASSIS,
    parameters=(EffectParameter("mass", "kg", "of each wheel unit, at the wheel contact, so off its steering axis"),),
    term=_SteeringUnitMass,
    words="{mass} of each wheel unit off its steering axis",
    usual=lambda vehicle, where: 0.01 * vehicle.prior["m_ch"],
    sign=Sign.NOT_NEGATIVE,
)

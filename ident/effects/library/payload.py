"""A load over the centre of the chassis."""

from __future__ import annotations

from typing import Final

import casadi as ca

from ident.effects.base import EffectKind, EffectParameter, EffectTerm
from ident.plant.places import CHASSIS
from ident.plant.symbolic import Expression
from ident.plant.terms import Masses, State, acceleration_at


class _Payload(EffectTerm):
    def load(self) -> Expression:
        """Its mass, which also presses on the wheels and is pulled down a slope."""
        return self["mass"]

    def forces(self, state: State, masses: Masses, parameters: Expression) -> Expression:
        """Of its inertia."""
        del masses, parameters
        linear = self["mass"] * acceleration_at(ca.SX.zeros(2), state)
        return ca.vertcat(linear, self["inertia"] * state.accelerations[2], ca.SX(6, 1))


EFFECT: Final = EffectKind(
    name="payload",
    rank=70,
    places=CHASSIS,
    parameters=(
        EffectParameter("mass", "kg", "mass over the centre that the model does not have"),
        EffectParameter("inertia", "kg m^2", "its inertia about the vertical axis", 0.0),
    ),
    term=_Payload,
    words="{mass} more mass over the centre, of an inertia of {inertia}",
    usual=lambda vehicle, where: 0.05 * vehicle.prior["m_ch"],
    adding=("mass", "inertia"),
)

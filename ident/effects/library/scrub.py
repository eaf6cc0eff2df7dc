"""Contact patches that resist turning on the spot."""

from __future__ import annotations

from typing import ClassVar, Final

import casadi as ca

from ident.effects.base import EffectKind, EffectParameter, EffectTerm, Sign, coulomb_friction, sign_of
from ident.plant.places import CHASSIS, STEERING, with_groups
from ident.plant.symbolic import Expression
from ident.plant.terms import State
from ident.vehicle.description import VehicleDescription


class _Scrub(EffectTerm):
    of_both_units: ClassVar[bool] = True

    def dry_friction(self, state: State, parameters: Expression) -> Expression:
        """Each patch resists the turning of its wheel over the floor; the torque is of a side, or of the vehicle."""
        del parameters
        sides, patches = ((0, 1), 4) if self.where in CHASSIS else (self.among(STEERING), 2)
        rows = ca.SX(9, 1)
        for side in sides:
            for turn in (+1, -1):  # front and rear wheel
                share = self["torque"] / patches * sign_of(state.rates[2] + turn * state.rates[3 + side])
                rows[2] += share
                rows[3 + side] += turn * share
        return rows


def _usual(vehicle: VehicleDescription, where: str) -> float:
    if where in CHASSIS:
        return sum(0.4 * coulomb_friction(vehicle, side) for side in STEERING)
    return 0.4 * coulomb_friction(vehicle, where)


EFFECT: Final = EffectKind(
    name="scrub",
    rank=180,
    places=(*with_groups(STEERING), *CHASSIS),
    parameters=(EffectParameter("torque", "Nm", "resistance of the contact patches to turning on the spot"),),
    term=_Scrub,
    words="contact patches that resist turning on the spot by {torque}",
    usual=_usual,
    sign=Sign.NOT_NEGATIVE,
)

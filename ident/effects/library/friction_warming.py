"""Friction that changes as a joint warms up: its share of change is 1 - exp(-t/T) of what it is in the end.

t is the time since the start of the campaign, T the time constant. Heat that the joint itself makes, and cooling at
rest, are not modelled.
"""

from __future__ import annotations

from typing import ClassVar, Final

import casadi as ca

from ident.effects.base import FRICTION, EffectKind, EffectParameter, EffectTerm, sign_of
from ident.plant.places import STEERING, WHEEL_PLACES, rows_of, with_groups
from ident.plant.symbolic import Expression
from ident.plant.terms import Masses, State
from ident.vehicle.parameters import parameter_column


class _FrictionWarming(EffectTerm):
    takes_time: ClassVar[bool] = True

    def forces(self, state: State, masses: Masses, parameters: Expression) -> Expression:
        """The change of the viscous friction."""
        del masses
        rows = ca.SX(9, 1)
        for row in rows_of(self.where):
            viscous = parameters[parameter_column(FRICTION[row][0])]
            rows[row] = self._share(state) * viscous * state.rates[row]
        return rows

    def dry_friction(self, state: State, parameters: Expression) -> Expression:
        """The change of the Coulomb friction."""
        rows = ca.SX(9, 1)
        for row in rows_of(self.where):
            coulomb = parameters[parameter_column(FRICTION[row][1])]
            rows[row] = self._share(state) * coulomb * sign_of(state.rates[row])
        return rows

    def _share(self, state: State) -> Expression:
        return self["change"] * (1 - ca.exp(-state.elapsed / self["time"]))


EFFECT: Final = EffectKind(
    name="friction_warming",
    rank=210,
    places=with_groups(STEERING, WHEEL_PLACES),
    parameters=(
        EffectParameter("change", "1", "viscous and Coulomb friction once warm, over those at the start, minus one"),
        EffectParameter("time", "s", "in which 63 % of the change have come", 300.0, positive=True),
    ),
    term=_FrictionWarming,
    words="friction that changes by {change} of itself within {time} of motion",
    usual=lambda vehicle, where: -0.2,
    always=False,
)

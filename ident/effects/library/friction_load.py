"""Dry friction that grows with the torque through the gear of a wheel, as that of teeth and of loaded seals does."""

from __future__ import annotations

from typing import Final

import casadi as ca

from ident.effects.base import EffectKind, EffectParameter, EffectTerm, Sign, sign_of
from ident.plant.places import WHEEL_PLACES, rows_of, with_groups
from ident.plant.symbolic import Expression
from ident.plant.terms import FIRST_WHEEL, State

ROUNDING: Final = 0.01
"""Torque through a gear up to which its size is rounded off [Nm at the wheel], so that derivatives exist."""


class _FrictionLoad(EffectTerm):
    def dry_friction(self, state: State, parameters: Expression) -> Expression:
        """A share of the load, beside the Coulomb friction."""
        del parameters
        rows = ca.SX(9, 1)
        for row in rows_of(self.where):
            load = state.loads[row - FIRST_WHEEL]
            rows[row] = self["share"] * (ca.sqrt(load**2 + ROUNDING**2) - ROUNDING) * sign_of(state.rates[row])
        return rows


EFFECT: Final = EffectKind(
    name="friction_load",
    rank=240,
    places=with_groups(WHEEL_PLACES),
    parameters=(EffectParameter("share", "1", "dry friction beyond Coulomb's over the torque through the gear"),),
    term=_FrictionLoad,
    words="dry friction that grows by {share} of the torque through the gear",
    usual=lambda vehicle, where: 0.08,
    sign=Sign.NOT_NEGATIVE,
    always=False,
    over=("load", "direction"),
)

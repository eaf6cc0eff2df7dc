"""Dry friction that grows along the travel of a steering axis, as where a bearing is out of line or hoses rub."""

from __future__ import annotations

from typing import Final

import casadi as ca

from ident.effects.base import EffectKind, EffectParameter, EffectTerm, coulomb_friction, sign_of
from ident.plant.places import STEERING, rows_of, with_groups
from ident.plant.symbolic import Expression
from ident.plant.terms import State


class _FrictionPosition(EffectTerm):
    def dry_friction(self, state: State, parameters: Expression) -> Expression:
        """The change beside the Coulomb friction, which is that straight ahead."""
        del parameters
        rows = ca.SX(9, 1)
        for row in rows_of(self.where):
            rows[row] = self["slope"] * state.alpha[row - 3] * sign_of(state.rates[row])
        return rows


EFFECT: Final = EffectKind(
    name="friction_position",
    rank=220,
    places=with_groups(STEERING),
    parameters=(EffectParameter("slope", "Nm/rad", "of the Coulomb friction over the steering angle"),),
    term=_FrictionPosition,
    words="dry friction that grows by {slope} along its travel",
    usual=lambda vehicle, where: 0.3 * coulomb_friction(vehicle, where),
    always=False,
    over=("angle", "direction"),
)

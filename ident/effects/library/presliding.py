"""Friction that bends bristles before it slides (Dahl 1968): it builds up over an angle after a reversal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import casadi as ca

from ident.effects.base import EffectKind, EffectParameter, EffectTerm, Sign, coulomb_friction
from ident.plant.places import STEERING, WHEEL_PLACES, rows_of, with_groups
from ident.plant.symbolic import Expression
from ident.plant.terms import Joint, Masses, State


class _Presliding(EffectTerm):
    def bristles(self) -> Mapping[Joint, Expression]:
        """One state a joint."""
        return {(self.where, row): self["angle"] for row in rows_of(self.where)}

    def forces(self, state: State, masses: Masses, parameters: Expression) -> Expression:
        """What the bristles resist, beside the Coulomb friction."""
        del masses, parameters
        rows = ca.SX(9, 1)
        for row in rows_of(self.where):
            rows[row] = self["amplitude"] * state.bent[self.where, row]
        return rows


EFFECT: Final = EffectKind(
    name="presliding",
    rank=250,
    places=with_groups(STEERING, WHEEL_PLACES),
    parameters=(
        EffectParameter("amplitude", "Nm", "friction of the bristles once they slide, beside Coulomb's"),
        EffectParameter("angle", "rad", "after a reversal over which they bend to 63 %", 0.1, positive=True),
    ),
    term=_Presliding,
    words="{amplitude} of the friction build up within {angle} after a reversal",
    usual=lambda vehicle, where: 0.2 * coulomb_friction(vehicle, where),
    sign=Sign.NOT_NEGATIVE,
    always=False,
    over=("path_since_reversal", "direction"),
)

"""Dry friction that depends on the direction."""

from __future__ import annotations

from typing import Final

from ident.effects.base import EffectKind, EffectParameter, JointTerm, coulomb_friction, sign_of
from ident.plant.places import STEERING, WHEEL_PLACES, with_groups
from ident.plant.symbolic import Expression


class _AsymmetricCoulomb(JointTerm):
    def dry_law(self, rate: Expression) -> Expression:
        """The same torque in both directions."""
        return self["imbalance"] * sign_of(rate) ** 2


EFFECT: Final = EffectKind(
    name="asymmetric_coulomb",
    rank=20,
    places=with_groups(STEERING, WHEEL_PLACES),
    parameters=(EffectParameter("imbalance", "Nm", "friction is d_c + imbalance forward, d_c - imbalance backward"),),
    term=_AsymmetricCoulomb,
    words="Coulomb friction {imbalance} beyond its mean forward, as much below it backward",
    usual=lambda vehicle, where: 0.3 * coulomb_friction(vehicle, where),
    over=("rate", ""),
)

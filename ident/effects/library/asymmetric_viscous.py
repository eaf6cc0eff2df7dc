"""Viscous friction that depends on the direction."""

from __future__ import annotations

from typing import Final

from ident.effects.base import EffectKind, EffectParameter, JointTerm, sign_of, viscous_friction
from ident.plant.places import STEERING, WHEEL_PLACES, with_groups
from ident.plant.symbolic import Expression


class _AsymmetricViscous(JointTerm):
    def law(self, rate: Expression) -> Expression:
        """Grows with the speed, in the same direction for both signs."""
        return self["imbalance"] * rate * sign_of(rate)


EFFECT: Final = EffectKind(
    name="asymmetric_viscous",
    rank=30,
    places=with_groups(STEERING, WHEEL_PLACES),
    parameters=(
        EffectParameter("imbalance", "Nm s/rad", "friction is d_v + imbalance forward, d_v - imbalance backward"),
    ),
    term=_AsymmetricViscous,
    words="viscous friction {imbalance} beyond its mean forward, as much below it backward",
    usual=lambda vehicle, where: 0.5 * viscous_friction(vehicle, where),
    over=("rate", ""),
)

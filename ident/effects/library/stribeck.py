"""Friction that is higher at rest: amplitude exp(-(rate/velocity)²) (Armstrong-Hélouvry 1994, exponent 2)."""

from __future__ import annotations

from typing import Final

import casadi as ca

from ident.effects.base import EffectKind, EffectParameter, JointTerm, coulomb_friction, sign_of
from ident.plant.places import STEERING, WHEEL_PLACES, with_groups
from ident.plant.symbolic import Expression


class _Stribeck(JointTerm):
    def dry_law(self, rate: Expression) -> Expression:
        """Beyond the Coulomb friction."""
        return self["amplitude"] * ca.exp(-((rate / self["velocity"]) ** 2)) * sign_of(rate)


EFFECT: Final = EffectKind(
    name="stribeck",
    rank=10,
    places=with_groups(STEERING, WHEEL_PLACES),
    parameters=(
        EffectParameter("amplitude", "Nm", "friction at rest beyond the Coulomb friction"),
        EffectParameter("velocity", "rad/s", "rate at which it has fallen to 1/e", 0.3, positive=True),
    ),
    term=_Stribeck,
    words="{amplitude} more friction at rest, most of it gone above {velocity}",
    usual=lambda vehicle, where: 0.4 * coulomb_friction(vehicle, where),
    over=("rate", ""),
)

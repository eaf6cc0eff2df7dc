"""A steering encoder whose zero is not straight ahead."""

from __future__ import annotations

from typing import Final

import casadi as ca

from ident.effects.base import EffectKind, EffectParameter, EffectTerm
from ident.plant.places import STEERING, with_groups
from ident.plant.symbolic import Expression


class _SteeringOffset(EffectTerm):
    def steering_errors(self) -> Expression:
        """The zero error."""
        errors = ca.SX(2, 1)
        for side in self.among(STEERING):
            errors[side] = self["offset"]
        return errors


EFFECT: Final = EffectKind(
    name="steering_offset",
    rank=160,
    places=with_groups(STEERING),
    parameters=(EffectParameter("offset", "rad", "angle reported minus true angle"),),
    term=_SteeringOffset,
    words="an angle reported {offset} too large",
    usual=lambda vehicle, where: 0.01,
)

"""A wheel that is larger than the vehicle file says."""

from __future__ import annotations

from types import MappingProxyType
from typing import Final

import casadi as ca

from ident.effects.base import EffectKind, EffectParameter, EffectTerm
from ident.plant.places import ALL_WHEELS, WHEEL_PLACES, with_groups
from ident.plant.symbolic import Expression


class _WheelRadius(EffectTerm):
    def radii(self, beta: Expression) -> Expression:
        """The same at every angle."""
        del beta
        more = ca.SX(4, 1)
        for wheel in self.among(WHEEL_PLACES):
            more[wheel] = self["error"]
        return more


EFFECT: Final = EffectKind(
    name="wheel_radius",
    rank=140,
    places=with_groups(WHEEL_PLACES),
    parameters=(EffectParameter("error", "m", "true radius minus the radius of the vehicle file"),),
    term=_WheelRadius,
    words="a radius {error} larger than in the vehicle file",
    over=("rate", "rolling"),
    usual=lambda vehicle, where: 0.01 * vehicle.geometry.wheel_radius,
    same_records=MappingProxyType({"scaled@beta": WHEEL_PLACES, "scaled@every beta": ALL_WHEELS}),
)

"""A centre of mass that is not the centre of the chassis."""

from __future__ import annotations

from typing import Final

import casadi as ca

from ident.effects.base import EffectKind, EffectParameter, EffectTerm
from ident.plant.places import CHASSIS
from ident.plant.symbolic import Expression


class _CentreOfMass(EffectTerm):
    def centre(self) -> Expression:
        """The shift of m_ch."""
        return ca.vertcat(self["x"], self["y"])


EFFECT: Final = EffectKind(
    name="com_offset",
    rank=60,
    places=CHASSIS,
    parameters=(
        EffectParameter("x", "m", "centre of mass ahead of the centre"),
        EffectParameter("y", "m", "centre of mass left of the centre", 0.0),
    ),
    term=_CentreOfMass,
    words="centre of mass {x} ahead and {y} left of the centre",
    usual=lambda vehicle, where: vehicle.geometry.wheelbase / 8,
    adding=("x", "y"),
    over=("angle", ""),
)

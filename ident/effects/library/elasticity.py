"""A gear, or the coupling of the two units of a steering side, that twists under load."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from ident.effects.base import EffectKind, EffectParameter, EffectTerm, Sign, coulomb_friction
from ident.plant.places import DRIVES, STEERING, members, with_groups
from ident.plant.symbolic import Expression
from ident.vehicle.description import VehicleDescription


class _Elasticity(EffectTerm):
    def compliances(self) -> Mapping[str, Expression]:
        """The twist per torque."""
        return self.everywhere("compliance")


def _usual(vehicle: VehicleDescription, where: str) -> float:
    """Four degrees at the rated torque of the drive, two at the friction of the steering."""
    if members(where)[0] in DRIVES:
        return 0.07 / (vehicle.geometry.gear_ratio * vehicle.limits.rated_torque)
    return 0.03 / coulomb_friction(vehicle, where)


EFFECT: Final = EffectKind(
    name="elasticity",
    rank=130,
    places=with_groups(DRIVES, STEERING),
    parameters=(EffectParameter("compliance", "rad/Nm", "twist per torque, at the wheel or at the steering axis"),),
    term=_Elasticity,
    words="a spring that twists by {compliance}",
    usual=_usual,
    sign=Sign.NOT_NEGATIVE,
    always=False,
)

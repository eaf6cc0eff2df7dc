"""A torque constant that is not the one that the drive reckons with."""

from __future__ import annotations

from types import MappingProxyType
from typing import Final

import casadi as ca

from ident.effects.base import EffectKind, EffectParameter, EffectTerm
from ident.plant.places import DRIVES, with_groups
from ident.plant.symbolic import Expression


class _TorqueGain(EffectTerm):
    def shaft_torques(self, reported: Expression, beta: Expression) -> Expression:
        """A share of what is reported."""
        del beta
        more = ca.SX(4, 1)
        for drive in self.among(DRIVES):
            more[drive] = self["error"] * reported[drive]
        return more


EFFECT: Final = EffectKind(
    name="torque_gain",
    rank=80,
    places=with_groups(DRIVES),
    parameters=(EffectParameter("error", "1", "torque at the shaft is (1 + error) times the torque reported"),),
    term=_TorqueGain,
    words="torque off by {error} of what is reported",
    usual=lambda vehicle, where: 0.05,
    same_records=MappingProxyType(
        {"scaled@torque": DRIVES, "sign_flipped@torque": DRIVES, "scaled@every torque": ("drives",)}
    ),
)

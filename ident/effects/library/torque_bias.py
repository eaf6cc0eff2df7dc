"""A torque that a drive gives and does not report."""

from __future__ import annotations

from typing import Final

import casadi as ca

from ident.effects.base import EffectKind, EffectParameter, EffectTerm
from ident.plant.places import DRIVES, with_groups
from ident.plant.symbolic import Expression


class _TorqueBias(EffectTerm):
    def shaft_torques(self, reported: Expression, beta: Expression) -> Expression:
        """The same at every angle."""
        del reported, beta
        more = ca.SX(4, 1)
        for drive in self.among(DRIVES):
            more[drive] = self["bias"]
        return more


EFFECT: Final = EffectKind(
    name="torque_bias",
    rank=90,
    places=with_groups(DRIVES),
    parameters=(EffectParameter("bias", "Nm", "torque at the motor shaft beyond the torque reported"),),
    term=_TorqueBias,
    words="{bias} of torque at the motor shaft that is not reported",
    usual=lambda vehicle, where: 0.08 * vehicle.limits.rated_torque,
)

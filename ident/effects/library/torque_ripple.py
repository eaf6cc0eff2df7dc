"""Cogging of a motor, or ripple of its torque, over the angle of its shaft."""

from __future__ import annotations

from typing import Final

import casadi as ca

from ident.effects.base import EffectKind, EffectParameter, EffectTerm
from ident.plant.places import DRIVES, with_groups
from ident.plant.symbolic import LENGTHS, Expression


class _TorqueRipple(EffectTerm):
    def shaft_torques(self, reported: Expression, beta: Expression) -> Expression:
        """A sine over the motor's angle."""
        del reported
        more = ca.SX(4, 1)
        for drive in self.among(DRIVES):
            angle = self["order"] * LENGTHS.i_G * beta[drive] + self["phase"]
            more[drive] = self["amplitude"] * ca.sin(angle)
        return more


EFFECT: Final = EffectKind(
    name="torque_ripple",
    rank=100,
    places=with_groups(DRIVES),
    parameters=(
        EffectParameter("amplitude", "Nm", "at the motor shaft, not reported"),
        EffectParameter("order", "1", "periods a revolution of the motor", 1.0),
        EffectParameter("phase", "rad", "at motor angle zero", 0.0),
    ),
    term=_TorqueRipple,
    words="a torque ripple of {amplitude}, {order} periods a turn",
    usual=lambda vehicle, where: 0.12 * vehicle.limits.rated_torque,
    polar=("amplitude", "phase"),
    over=("angle", ""),
)

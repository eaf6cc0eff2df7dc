"""A parameter that is not what the model has."""

from __future__ import annotations

from types import MappingProxyType
from typing import Final

import casadi as ca

from ident.effects.base import EffectKind, EffectParameter, EffectTerm
from ident.plant.symbolic import Expression
from ident.plant.terms import State
from ident.vehicle.description import VehicleDescription
from ident.vehicle.parameters import PARAMETER_NAMES, parameter_column


class _ParameterChange(EffectTerm):
    def parameter_changes(self, state: State) -> Expression:
        """Of one parameter."""
        del state
        shares = ca.SX(len(PARAMETER_NAMES), 1)
        shares[parameter_column(self.where)] = self["change"]
        return shares


def _usual(vehicle: VehicleDescription, where: str) -> float:
    """As unsure as the vehicle file is, at least a tenth."""
    return max(vehicle.prior.std_of(where) / vehicle.prior[where], 0.1)


EFFECT: Final = EffectKind(
    name="parameter_change",
    rank=200,
    places=PARAMETER_NAMES,
    parameters=(EffectParameter("change", "1", "true value over the model's, minus one"),),
    term=_ParameterChange,
    words="off by {change} of the model's value",
    usual=_usual,
    always=False,  # the parameters themselves can be set
    same_records=MappingProxyType({"scaled@every torque": ("all parameters of the vehicle file",)}),
    over=("rate", ""),
)

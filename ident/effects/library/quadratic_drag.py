"""Resistance that grows with the square of the speed, of wheels or of the whole vehicle."""

from __future__ import annotations

from types import MappingProxyType
from typing import Final

import casadi as ca

from ident.effects.base import EffectKind, EffectParameter, JointTerm
from ident.plant.places import CHASSIS, WHEEL_PLACES, with_groups
from ident.plant.symbolic import EPSILON, Expression
from ident.plant.terms import Masses, State
from ident.vehicle.description import VehicleDescription


class _QuadraticDrag(JointTerm):
    def law(self, rate: Expression) -> Expression:
        """Of a wheel."""
        return self["coefficient"] * rate * ca.fabs(rate)

    def forces(self, state: State, masses: Masses, parameters: Expression) -> Expression:
        """At wheels; at the chassis against its velocity, wherever that points."""
        if self.where not in CHASSIS:
            return super().forces(state, masses, parameters)
        velocity = state.rates[:2]
        speed = ca.sqrt(ca.sumsqr(velocity) + EPSILON**4)  # the addend keeps the derivative finite at rest
        return ca.vertcat(self["coefficient"] * speed * velocity, ca.SX(7, 1))


def _usual(vehicle: VehicleDescription, where: str) -> float:
    """A tenth of what the motors can do for long, at their full speed."""
    geometry, limits = vehicle.geometry, vehicle.limits
    torque, rate = geometry.gear_ratio * limits.rated_torque, limits.motor_speed / geometry.gear_ratio
    if where in CHASSIS:
        return 0.1 * 4 * torque / geometry.wheel_radius / (geometry.wheel_radius * rate) ** 2
    return 0.1 * torque / rate**2


EFFECT: Final = EffectKind(
    name="quadratic_drag",
    rank=40,
    places=with_groups(WHEEL_PLACES, CHASSIS),
    parameters=(EffectParameter("coefficient", "Nm s^2/rad^2", "resistance is coefficient times v abs(v)"),),
    term=_QuadraticDrag,
    words="drag that grows with the square of the speed, {coefficient}",
    usual=_usual,
    units_at=MappingProxyType({CHASSIS[0]: {"coefficient": "N s^2/m^2"}}),
    over=("rate", ""),
)

"""A floor that is inclined."""

from __future__ import annotations

from typing import Final

from ident.effects.base import EffectKind, EffectParameter, EffectTerm
from ident.plant.places import CHASSIS
from ident.plant.symbolic import Expression
from ident.plant.terms import pull
from ident.vehicle.description import VehicleDescription
from ident.vehicle.quantities import GRAVITY


class _Slope(EffectTerm):
    def uphill(self, heading: Expression) -> Expression:
        """In the direction that points uphill."""
        return pull(self["angle"], self["direction"] - heading)


def _usual(vehicle: VehicleDescription, where: str) -> float:
    """A third of the slope that its friction holds the vehicle on."""
    del where
    prior = vehicle.prior
    return 4 * prior["d_cw"] / vehicle.geometry.wheel_radius / (3 * GRAVITY * prior["m_ch"])


EFFECT: Final = EffectKind(
    name="slope",
    rank=50,
    places=CHASSIS,
    parameters=(
        EffectParameter("angle", "rad", "inclination of the floor"),
        EffectParameter("direction", "rad", "heading in the world that points uphill", 0.0),
    ),
    term=_Slope,
    words="a floor inclined by {angle}, uphill towards a heading of {direction}",
    usual=_usual,
    polar=("angle", "direction"),  # the angle is small enough for a length
)

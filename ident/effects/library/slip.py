"""Wheels or a floor of less grip than usual: beyond it they slide."""

from __future__ import annotations

from types import MappingProxyType
from typing import Final

from ident.effects.base import EffectKind, EffectParameter, EffectTerm
from ident.plant.places import CHASSIS, WHEEL_PLACES, indices, with_groups
from ident.vehicle.geometry import WHEELS

_PLACES: Final = (*CHASSIS, *with_groups(WHEEL_PLACES))


def _limits(where: str) -> tuple[str, ...]:
    wheels = range(4) if where in CHASSIS else indices(where, WHEEL_PLACES)
    return tuple(f"friction_limit_{WHEELS[wheel]}" for wheel in wheels)


EFFECT: Final = EffectKind(
    name="slip",
    rank=170,
    places=_PLACES,
    parameters=(
        EffectParameter("friction", "1", "friction coefficient of the floor, or of the tyre, instead of the usual"),
    ),
    term=EffectTerm,
    words="contacts that slide at a friction coefficient of {friction}",
    usual=lambda vehicle, where: 0.25 * vehicle.limits.floor_friction,
    adding=(),  # coefficients of friction of one floor do not add up
    always=False,
    stands_for=MappingProxyType({where: _limits(where) for where in _PLACES}),
)

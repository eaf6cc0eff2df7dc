"""Several entries of one effect at one place as one: what a model has of it, and what was found of it beyond that."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.vehicle.effects import EFFECTS, Effect, EffectName, make_effect

Array = NDArray[np.float64]

_POLAR: Final[Mapping[EffectName, tuple[str, str]]] = MappingProxyType(
    {
        EffectName.SLOPE: ("angle", "direction"),
        EffectName.TORQUE_RIPPLE: ("amplitude", "phase"),
        EffectName.WHEEL_ECCENTRICITY: ("amplitude", "phase"),
    }
)
"""Effects of which a length and an angle add up as vectors do; the angle of a slope is small enough for a length."""

_SUMS: Final[Mapping[EffectName, tuple[str, ...]]] = MappingProxyType(
    {EffectName.COM_OFFSET: ("x", "y"), EffectName.PAYLOAD: ("mass", "inertia"), EffectName.SLIP: ()}
)
"""Parameters that add up, where that is not the size alone. Coefficients of friction of one floor do not."""


def combined(effects: Sequence[Effect]) -> tuple[Effect, ...]:
    """The same effects, those of one name and place as one where their equations add up to one.

    What does not add up must be equal: two ripples of one order are a ripple, two Stribeck frictions that fall off at
    other rates stay two. A later entry is what was found beside an earlier one, which was taken as it is: how sure the
    sum is, the later one says.
    """
    found: list[Effect] = []
    for effect in effects:
        place = next((index for index, other in enumerate(found) if _are_one(other, effect)), None)
        if place is None:
            found.append(effect)
        else:
            found[place] = _sum(found[place], effect)
    return tuple(found)


def _are_one(first: Effect, second: Effect) -> bool:
    if (first.name, first.where) != (second.name, second.where):
        return False
    adding = _POLAR.get(first.name) or _added(first.name)
    return bool(adding) and all(first[name] == second[name] for name in first.parameters if name not in adding)


def _added(name: EffectName) -> tuple[str, ...]:
    return _SUMS.get(name, (EFFECTS[name].size.name,))


def _sum(first: Effect, second: Effect) -> Effect:
    sum_of: Callable[..., tuple[dict[str, float], dict[str, float]]] = (
        _vector_sum if first.name in _POLAR else _plain_sum
    )
    kept = {name: first[name] for name in first.parameters}
    spread = {name: quantity.std for name, quantity in first.parameters.items()}
    values, std = sum_of(first, second)
    return make_effect(first.name, first.where, kept | values, spread | std)


def _plain_sum(first: Effect, second: Effect) -> tuple[dict[str, float], dict[str, float]]:
    names = _added(first.name)
    values = {name: first[name] + second[name] for name in names}
    return values, {name: second.parameters[name].std for name in names}


def _vector_sum(first: Effect, second: Effect) -> tuple[dict[str, float], dict[str, float]]:
    names = _POLAR[first.name]
    (known, _), (found, covariance) = (_cartesian(effect, names) for effect in (first, second))
    total = known + found
    length, angle = float(np.hypot(*total)), float(np.arctan2(total[1], total[0]))
    along, across = _axes(angle)
    std = (math.sqrt(along @ covariance @ along), math.sqrt(across @ covariance @ across))
    turn = min(std[1] / length, math.pi) if length else math.pi
    return dict(zip(names, (length, angle), strict=True)), dict(zip(names, (std[0], turn), strict=True))


def _cartesian(effect: Effect, names: tuple[str, str]) -> tuple[Array, Array]:
    """A vector (2,) and its covariance (2, 2)."""
    length, angle = (effect[name] for name in names)
    std, turn = (effect.parameters[name].std for name in names)
    along, across = _axes(angle)
    return length * along, std**2 * np.outer(along, along) + (length * turn) ** 2 * np.outer(across, across)


def _axes(angle: float) -> tuple[Array, Array]:
    return np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])

"""What a model has of an effect and what was found beside that, as one effect."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.effects import Effect, kind_of, make_effect

Array = NDArray[np.float64]
Numbers = tuple[dict[str, float], dict[str, float]]
"""Values and standard deviations by parameter."""

AGREE: Final = 3.0
"""Standard deviations by which two estimates of one number may differ."""


def combined(known: Sequence[Effect], found: Sequence[Effect]) -> tuple[Effect, ...]:
    """The known effects with what was found beside them: added to the one of its name and place, or behind them.

    What does not add up, the rate at which Stribeck friction falls off or the order of a ripple, must agree with the
    known one, and is then taken from there; otherwise both stay. The known numbers are what others were measured from:
    how sure a sum is, what was found says.
    """
    effects = list(known)
    for effect in found:
        place = next((index for index, other in enumerate(known) if _are_one(other, effect)), None)
        if place is None:
            effects.append(effect)
        else:
            effects[place] = _sum(effects[place], effect)
    return tuple(effects)


def _are_one(known: Effect, found: Effect) -> bool:
    if (known.name, known.where) != (found.name, found.where):
        return False
    adding = kind_of(known.name).sums
    return bool(adding) and all(_agree(known, found, name) for name in known.parameters if name not in adding)


def _agree(known: Effect, found: Effect, parameter: str) -> bool:
    std = math.hypot(known.parameters[parameter].std, found.parameters[parameter].std)
    return abs(known[parameter] - found[parameter]) <= AGREE * std


def _sum(known: Effect, found: Effect) -> Effect:
    polar = kind_of(known.name).polar
    values, std = _plain_sum(known, found) if polar is None else _vector_sum(known, found, *polar)
    kept = {name: known[name] for name in known.parameters}
    spread = {name: quantity.std for name, quantity in known.parameters.items()}
    return make_effect(known.name, known.where, kept | values, spread | std)


def _plain_sum(known: Effect, found: Effect) -> Numbers:
    names = kind_of(known.name).sums
    return {name: known[name] + found[name] for name in names}, {name: found.parameters[name].std for name in names}


def _vector_sum(known: Effect, found: Effect, size: str, bearing: str) -> Numbers:
    length, angle = found[size], found[bearing]
    along, across = _axes(angle)
    std, turn = found.parameters[size].std, length * found.parameters[bearing].std
    covariance = std**2 * np.outer(along, along) + turn**2 * np.outer(across, across)
    total = length * along + known[size] * _axes(known[bearing])[0]
    length, angle = float(np.hypot(*total)), float(np.arctan2(total[1], total[0]))
    along, across = _axes(angle)
    std, turn = math.sqrt(along @ covariance @ along), math.sqrt(across @ covariance @ across)
    return {size: length, bearing: angle}, {size: std, bearing: min(turn / length, math.pi) if length else math.pi}


def _axes(angle: float) -> tuple[Array, Array]:
    return np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])

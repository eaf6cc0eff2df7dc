"""Wheels that stand askew: what points them to different centres also makes some of them slide.

While all of them roll, what an askew wheel does to the rolling rows is a matter of geometry. Once one slides, forces
decide (see `ident.diagnosis.vehicle.sliding`), and geometry says nothing. So the kinematic columns of such a cause end
where a wheel slides, and the sliding itself, as it was found, may come along with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.names import EffectName
from ident.diagnosis.problem import Candidate, Variant
from ident.plant.places import STEERING

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

ASKEW: Final = (EffectName.STEERING_OFFSET, EffectName.ELASTICITY, EffectName.BACKLASH)
"""Causes that leave the wheels of a vehicle askew, at the places of `STEERING`."""


def stands_askew(candidate: Candidate) -> bool:
    """Whether a cause is one of them."""
    return candidate.effect in ASKEW and candidate.where in STEERING


def beside_sliding(candidate: Candidate, slid: Sequence[Array | None], rolling: Sequence[Mask | None]) -> Candidate:
    """A cause that may come with sliding.

    Args:
        candidate: the cause, linear in its columns or with a contribution.
        slid: (N,) what sliding adds to every block.
        rolling: (N,) of every block, where no wheel slides; None where it does not matter.
    """
    variants = tuple(
        Variant(
            tuple(_joined(*parts, _width(variant)) for parts in zip(variant.columns, rolling, slid, strict=True)),
            beside=variant.beside + 1,
            itself=False,
        )
        for variant in candidate.variants
    )
    if candidate.contribution is None:
        return replace(candidate, variants=variants, others=1)
    exact = candidate.contribution

    def contribution(values: Array, parameters: Array) -> list[Array | None]:
        own = exact(values[:-1], parameters)
        return [_sum(*parts, float(values[-1])) for parts in zip(own, rolling, slid, strict=True)]

    return replace(candidate, variants=variants, contribution=contribution, others=1)


def _width(variant: Variant) -> int:
    return next((column.shape[1] for column in variant.columns if column is not None), 0)


def _joined(own: Array | None, rolling: Mask | None, slid: Array | None, width: int) -> Array | None:
    """Columns (N, width + 1)."""
    there = own if own is not None else slid
    if there is None:
        return None
    columns = np.zeros((len(there), width + 1))
    if own is not None:
        columns[:, :width] = _masked(own, rolling)
    if slid is not None:
        columns[:, width] = slid
    return columns


def _sum(own: Array | None, rolling: Mask | None, slid: Array | None, amount: float) -> Array | None:
    parts = [] if own is None else [_masked(own, rolling)]
    if slid is not None:
        parts.append(amount * slid)
    return sum(parts[1:], start=parts[0]) if parts else None


def _masked(series: Array, rolling: Mask | None) -> Array:
    if rolling is None:
        return series
    return series * (rolling if series.ndim == 1 else rolling[:, None])

"""Whitening of coloured residuals: an autoregression for every group of rows, restarted at every interruption."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.gap.rows import Rows

Array = NDArray[np.float64]

ORDER: Final = 20
"""Of the autoregression: slow noise hides below fast noise, and shows only over many rows."""
TOLERATED_MEMORY: Final = 0.5
"""Correlation time of what is tolerated [s]: it is model error, and as slow as the motion."""
TAPER: Final = 1e-4
"""White share added to the variance, so that a band without any power is not blown up."""


@dataclass(frozen=True)
class Predictor:
    """Best linear predictions from 0 to ORDER rows back (Levinson and Durbin).

    Attributes:
        weights: row i (i,) predicts from the i rows before, newest first.
        deviations: of the prediction error, (ORDER + 1,).
    """

    weights: tuple[Array, ...]
    deviations: Array


@dataclass(frozen=True)
class Whitener:
    """Turns rows of coloured noise into rows of white noise of unit variance."""

    predictors: tuple[Predictor, ...]

    def apply(self, rows: Rows, values: Array) -> Array:
        """Whitened copy of (n,) or (n, k)."""
        white = np.array(values, dtype=float)
        age = row_ages(rows)
        for group, predictor in enumerate(self.predictors):
            for depth, weights in enumerate(predictor.weights):
                last = depth == len(predictor.weights) - 1
                place = np.flatnonzero((rows.group == group) & ((age >= depth) if last else (age == depth)))
                for back, weight in enumerate(weights, 1):
                    white[place] -= weight * values[place - back]
                white[place] /= predictor.deviations[depth]
        return white


def row_ages(rows: Rows) -> NDArray[np.int64]:
    """How many rows of the same run lie before each row (n,)."""
    number = np.arange(len(rows))
    starts = np.flatnonzero(np.diff(rows.run, prepend=-1) != 0)
    lengths = np.diff(np.append(starts, len(rows)))
    return np.asarray(number - np.repeat(starts, lengths))


def fit_whitener(rows: Rows, residual: Array, freedom_lost: float = 0.0, order: int = ORDER) -> Whitener:
    """Whitener of a residual (n,); `freedom_lost` parameters were fitted to it. Of order 0, it only scales."""
    age = row_ages(rows)
    inflation = len(rows) / max(len(rows) - freedom_lost, 1.0)
    tolerated = _tolerated(rows)
    groups = range(int(rows.group.max(initial=-1)) + 1)
    return Whitener(
        tuple(_predictor(residual, age, rows.group == group, inflation, tolerated[group], order) for group in groups)
    )


def _tolerated(rows: Rows) -> Array:
    """Autocovariance (G, ORDER + 1) of what is tolerated in every group: a slow process of the tolerance's variance."""
    found = np.zeros((int(rows.group.max(initial=-1)) + 1, ORDER + 1))
    for (block, kept), place in zip(rows.blocks, rows.block_slices, strict=True):
        if place.stop > place.start:
            memory = np.arange(ORDER + 1) / (kept.rate * TOLERATED_MEMORY)
            found[rows.group[place.start]] = block.tolerance**2 * np.exp(-memory)
    return found


def _predictor(
    residual: Array, age: NDArray[np.int64], chosen: NDArray[np.bool_], inflation: float, tolerated: Array, order: int
) -> Predictor:
    place = np.flatnonzero(chosen)
    depth = min(order, len(place) // 20)
    covariance = np.empty(depth + 1)
    for lag in range(depth + 1):
        later = place[age[place] >= lag]
        covariance[lag] = residual[later] @ residual[later - lag]
    covariance *= inflation / max(len(place), 1)
    covariance += tolerated[: depth + 1]
    covariance[0] = max(covariance[0] * (1 + TAPER), np.finfo(float).tiny)
    return _levinson(covariance)


def _levinson(covariance: Array) -> Predictor:
    weights, variance = [np.zeros(0)], [covariance[0]]
    for order in range(1, len(covariance)):
        before = weights[-1]
        reflection = (covariance[order] - before @ covariance[order - 1 : 0 : -1]) / variance[-1]
        reflection = float(np.clip(reflection, -0.999, 0.999))
        weights.append(np.append(before - reflection * before[::-1], reflection))
        variance.append(variance[-1] * (1 - reflection**2))
    return Predictor(tuple(weights), np.sqrt(np.array(variance)))

"""Whitening of coloured residuals: an autoregression for every group of rows, restarted at every interruption.

Where steps repeat, the colour is that of what differs between the repeats: what repeats is not in it, so that no effect
can be taken for noise. It counts as long as what the best candidates leave is about as small; where model errors
prevail, and where nothing repeats, the colour is that of what is left. An autoregression of order d leaves 1 - d/n of
the noise of the n rows that it is fitted to, and 1 + d/n of that of others (Akaike 1969).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from ident.diagnosis.observations.autoregression import ORDER, autocovariance
from ident.diagnosis.observations.linear import starts_of
from ident.diagnosis.observations.rows import Rows

Array = NDArray[np.float64]

TOLERATED_MEMORY: Final = 0.5
"""Correlation time of what is tolerated [s]: it is model error, and as slow as the motion."""
PREVAILING: Final = 2.0
"""Power of what is left, over that of the noise in the mean of the repeats, from which model errors prevail."""
ROWS_PER_ORDER: Final = 20
"""Rows that every order of an autoregression is fitted to at least."""
STRIDE: Final = 128
"""Rows that are whitened at once."""
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

    @cached_property
    def matrix(self) -> Array:
        """What turns the first rows of a run into white ones: (m, m) lower triangular, a band from its order on."""
        order = len(self.weights) - 1
        found = np.zeros((order + STRIDE, order + STRIDE))
        for row, weights in enumerate(self.weights):
            found[row, : row + 1] = np.append(-weights[::-1], 1.0) / self.deviations[row]
        below = np.arange(STRIDE)[:, None]
        found[order + below, below + np.arange(order + 1)] = found[order, : order + 1]
        return found

    def apply(self, run: Array) -> Array:
        """White rows of an uninterrupted run (m, k)."""
        order, matrix = len(self.weights) - 1, self.matrix
        first = matrix[: len(run), : len(run)] @ run[: len(matrix)]
        rest = [
            matrix[order : order + len(run) - start, : order + len(run) - start] @ run[start - order : start + STRIDE]
            for start in range(len(matrix), len(run), STRIDE)
        ]
        return np.concatenate([first, *rest])


class Whitening(Protocol):
    """What turns rows of coloured noise into rows of white noise of unit variance."""

    def apply(self, rows: Rows, values: Array) -> Array:
        """Whitened copy of (n,) or (n, k)."""


@dataclass(frozen=True)
class Whitener:
    """Turns rows of coloured noise into rows of white noise of unit variance."""

    predictors: tuple[Predictor, ...]

    def apply(self, rows: Rows, values: Array) -> Array:
        """Whitened copy of (n,) or (n, k)."""
        whole = np.asarray(values, dtype=float)[:, None] if np.ndim(values) == 1 else np.asarray(values, dtype=float)
        white, ends = np.empty_like(whole), np.flatnonzero(np.diff(rows.run, append=-1) != 0) + 1
        for start, end in pairwise([0, *ends.tolist()]):
            white[start:end] = self.predictors[rows.group[start]].apply(whole[start:end])
        return white.reshape(np.shape(values))


def row_ages(rows: Rows) -> NDArray[np.int64]:
    """How many rows of the same run lie before each row (n,)."""
    number = np.arange(len(rows))
    starts = starts_of(rows.run)
    lengths = np.diff(np.append(starts, len(rows)))
    return np.asarray(number - np.repeat(starts, lengths))


@dataclass(frozen=True)
class Colour:
    """Autocovariance of a group of rows, and how many rows it was taken from; no rows where it is not known."""

    covariance: Array
    count: int


@dataclass(frozen=True)
class Left:
    """What a model leaves of the rows.

    Attributes:
        residual: (n,).
        fitted: how many coefficients were, what is known of them beforehand taken off.
    """

    residual: Array
    fitted: float


def colours_of_repeats(rows: Rows, residuals: Sequence[Array]) -> tuple[Colour, ...]:
    """Colour of the noise in the mean over the repeats, by group, from what differs between them.

    Args:
        rows: of all blocks.
        residuals: of every block, (N,), of any model: what repeats in them cancels.
    """
    ages = row_ages(rows)
    differing: dict[int, list[tuple[Array, NDArray[np.int64]]]] = {}
    for (_, kept), place, residual in zip(rows.blocks, rows.block_slices, residuals, strict=True):
        if place.stop > place.start:
            repeats = len(kept.samples)
            # P - 1 independent contrasts of P repeats, each as large as what is left in their mean.
            contrasts = linalg.helmert(repeats) @ residual[kept.samples] / math.sqrt(repeats)
            own = contrasts.ravel(), np.tile(ages[place], repeats - 1)
            differing.setdefault(int(rows.group[place.start]), []).append(own)
    return tuple(_colour_of(differing[group]) for group in sorted(differing))


def _colour_of(blocks: Sequence[tuple[Array, NDArray[np.int64]]]) -> Colour:
    """Of contrasts of every block; the errors of predictions are those of rows that they are not made of.

    The mean of the repeats is independent of what differs between them.
    """
    values, ages = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
    count = len(values) if all(len(one) for one, _ in blocks) else 0
    return Colour((1 + _depth(count) / max(count, 1)) * _unpredicted(values, ages), count)


def _unpredicted(values: Array, ages: NDArray[np.int64], order: int = ORDER) -> Array:
    """Autocovariance (ORDER + 1,) of rows (n,), as large as before an autoregression was fitted to them."""
    count = len(values)
    return autocovariance(values, ages) * (count / max(count - _depth(count, order), 1))


def _depth(count: int, most: int = ORDER) -> int:
    """Order of an autoregression that so many rows bear."""
    return min(most, count // ROWS_PER_ORDER)


def fit_whitener(
    rows: Rows,
    residual: Array,
    freedom_lost: float = 0.0,
    order: int = ORDER,
    repeats: Sequence[Colour] | None = None,
) -> Whitener:
    """Whitener of a residual (n,); `freedom_lost` parameters were fitted to it. Of order 0, it only scales.

    `repeats` are the colours of `colours_of_repeats`; without them, only what is left has one.
    """
    colours = colours_of(rows, Left(residual, freedom_lost), order)
    if repeats is not None:
        colours = [
            known if known.count and own.covariance[0] <= PREVAILING * known.covariance[0] else own
            for own, known in zip(colours, repeats, strict=True)
        ]
    return whitener_of(rows, colours, order)


def colours_of(rows: Rows, left: Left, order: int = ORDER) -> Sequence[Colour]:
    """Colour of what is left of every group of rows, as large as before coefficients and predictions were fitted."""
    inflation, age = len(rows) / max(len(rows) - left.fitted, 1.0), row_ages(rows)
    places = [np.flatnonzero(rows.group == group) for group in range(int(rows.group.max(initial=-1)) + 1)]
    return [Colour(inflation * _unpredicted(left.residual[own], age[own], order), len(own)) for own in places]


def whitener_of(rows: Rows, colours: Sequence[Colour], order: int = ORDER) -> Whitener:
    """Whitener of noise of a colour for every group, and of what is tolerated there."""
    tolerated = _tolerated(rows)
    return Whitener(tuple(_predictor(one, own, order) for one, own in zip(colours, tolerated, strict=True)))


def _tolerated(rows: Rows) -> Array:
    """Autocovariance (G, ORDER + 1) of what is tolerated in every group: a slow process of the tolerance's variance."""
    found = np.zeros((int(rows.group.max(initial=-1)) + 1, ORDER + 1))
    for (block, kept), place in zip(rows.blocks, rows.block_slices, strict=True):
        if place.stop > place.start:
            memory = np.arange(ORDER + 1) / (kept.rate * TOLERATED_MEMORY)
            group = rows.group[place.start]
            found[group] = np.maximum(found[group], block.tolerance**2 * np.exp(-memory))
    return found


def predictor_of(colour: Colour) -> Predictor:
    """Of noise that has a colour."""
    return _predictor(colour, np.zeros(ORDER + 1), ORDER)


def _predictor(colour: Colour, tolerated: Array, order: int) -> Predictor:
    depth = _depth(colour.count, order)
    covariance = colour.covariance[: depth + 1] + tolerated[: depth + 1]
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

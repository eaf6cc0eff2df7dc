"""Directions that candidates add to the baseline: their columns, orthogonal to what the parameters can absorb."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.observations.linear import orthonormal
from ident.diagnosis.observations.rows import Column

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

VISIBLE: Final = 0.02
"""Part of a column that the baseline must leave for it to count as visible."""


@dataclass(frozen=True)
class White:
    """Whitened regression, rows of prior knowledge behind those of the records.

    Attributes:
        target: (n,).
        baseline: (n, p + c) columns of the model, and of effects that are taken as given.
        columns: (n, K) of all candidates.
        confirming: (n,) rows that take no part in the fit.
    """

    target: Array
    baseline: Array
    columns: Array
    confirming: Mask


@dataclass(frozen=True)
class Bounded:
    """A variant of k columns whose coefficients have a least value.

    Attributes:
        variant: which.
        place: of its directions.
        turn: (k, directions) amplitudes -> coefficients.
        least: of all coefficients.
    """

    variant: int
    place: slice
    turn: Array
    least: float


@dataclass(frozen=True)
class Directions:
    """Orthonormal directions that each variant of a candidate adds to the baseline.

    Attributes:
        basis: (n, D).
        places: of every variant in the basis; empty where the baseline absorbs it.
        least: (D,) amplitudes below which a direction counts nothing.
        negligible: (D, 2) the same as sizes, of negative and of positive ones.
        bounded: variants of several columns whose coefficients have a least value.
        residual: (n,) target minus its projection on the baseline.
    """

    basis: Array
    places: tuple[slice, ...]
    least: Array
    negligible: Array
    residual: Array
    bounded: tuple[Bounded, ...] = ()

    @property
    def sizes(self) -> Array:
        """Number of directions of every variant."""
        return np.array([place.stop - place.start for place in self.places])

    def possible(self, amplitudes: Array) -> Mask:
        """Which amplitudes (..., D) are as large as they must be."""
        limit = np.where(amplitudes < 0, self.negligible[:, 0], self.negligible[:, 1])
        found = (amplitudes >= self.least) & (np.abs(amplitudes) >= limit)
        for several in self.bounded:
            coefficients = amplitudes[..., several.place] @ several.turn.T
            found[..., several.place] &= np.all(coefficients >= several.least, axis=-1, keepdims=True)
        return np.asarray(found)

    def ratios(self, amplitudes: Array) -> Array:
        """Sums of squared amplitudes (..., D) over the directions of every variant, (..., V)."""
        counted = np.where(self.possible(amplitudes), amplitudes, 0.0)
        squares = np.concatenate([np.zeros((*amplitudes.shape[:-1], 1)), np.cumsum(counted**2, axis=-1)], axis=-1)
        starts = [place.start for place in self.places]
        stops = [place.stop for place in self.places]
        return np.asarray(squares[..., stops] - squares[..., starts])


def directions(white: White, layout: Sequence[Column]) -> Directions:
    """Directions beside the baseline."""
    base, target, columns = orthonormal(white.baseline), white.target, white.columns
    residual = target - base @ (base.T @ target)
    left = np.asfortranarray(columns - base @ (base.T @ columns))
    full = np.linalg.norm(white.columns, axis=0)
    scale = np.where(full > 0, full, 1.0)
    length = np.linalg.norm(left, axis=0)
    found = [
        _alone(left, scale, length, column) if column.width == 1 else _together(left, scale, column)
        for column in layout
    ]
    ends = np.cumsum([0, *(one.count for one in found)]).tolist()
    places = tuple(slice(start, stop) for start, stop in itertools.pairwise(ends))
    basis = np.empty((len(target), ends[-1]), order="F")
    for one, place in zip(found, places, strict=True):
        basis[:, place] = one.vectors
    bounds = [one.bounds for one in found for _ in range(one.count)]
    limits = np.array(bounds).reshape(-1, 3)
    bounded = tuple(
        Bounded(number, place, one.turn, column.least)
        for number, (one, place, column) in enumerate(zip(found, places, layout, strict=True))
        if one.turn is not None
    )
    return Directions(basis, places, limits[:, 0], limits[:, 1:], residual, bounded)


@dataclass(frozen=True)
class _Added:
    """What one variant adds: directions (n, count), limits of their amplitudes, bounded ones' turn."""

    vectors: Array
    bounds: tuple[float, float, float]
    turn: Array | None = None

    @property
    def count(self) -> int:
        return int(self.vectors.shape[1])


def _alone(left: Array, scale: Array, length: Array, column: Column) -> _Added:
    """Of a single column, which needs no decomposition."""
    place = column.place
    whole = float(length[place.start])
    relative = whole / float(scale[place.start])
    seen = relative > VISIBLE
    vectors = left[:, place] / whole if seen else left[:, :0]
    low, high = column.negligible
    bounds = (column.least * whole, low * whole, high * whole)
    return _Added(vectors, bounds)


def _together(left: Array, scale: Array, column: Column) -> _Added:
    """Of several columns, few beside the rows: by the eigenvectors of their products, as far as they are visible."""
    unit = scale[column.place]
    columns = left[:, column.place] / unit
    powers, turn = np.linalg.eigh(columns.T @ columns)
    singular, turn = np.sqrt(np.maximum(powers[::-1], 0.0)), turn[:, ::-1]
    count = int(np.sum(singular > VISIBLE))
    by_length = turn[:, :count] / singular[:count]
    bound = count > 0 and math.isfinite(column.least)
    coefficients = by_length / unit[:, None] if bound else None
    return _Added(columns @ by_length, (-math.inf, *column.negligible), coefficients)

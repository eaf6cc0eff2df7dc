"""Linear algebra on columns of any scale."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

RANK: Final = 1e-7
"""Smallest singular value, relative to the largest, of a column that counts."""

ROUNDING: Final = 1e-9
"""Of a number, relative to those that it was computed from, that is none."""


def orthonormal(columns: Array, rank: float = RANK) -> Array:
    """Orthonormal basis of columns of any scale; singular values up to `rank` of the largest are left out."""
    norms = np.linalg.norm(columns, axis=0)
    scaled = columns[:, norms > 0] / norms[norms > 0]
    vectors, singular, _ = np.linalg.svd(scaled, full_matrices=False)
    return np.asarray(vectors[:, singular > rank * singular.max(initial=0.0)])


def with_known(white: Array, target: Array, known: tuple[Array, Array]) -> tuple[Array, Array]:
    """Rows (n + m + k, k) of least squares and their target: coefficients of unit variance, and what is known beside.

    Columns of a plant of which next to nothing is known are nearly the same in units of that: products of these rows
    would have lost all digits of what is left.

    Args:
        white: (n, k) rows in units of their noise.
        target: (n,).
        known: (m, k) and (m,) rows beside those of the records, in standard deviations.
    """
    beside, wanted = known
    width = white.shape[1]
    return np.vstack([white, beside, np.eye(width)]), np.concatenate([target, wanted, np.zeros(width)])


def rms(values: Array) -> float:
    """Root of the mean square of all values; zero of none."""
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0


def starts_of(numbers: NDArray[np.int64]) -> NDArray[np.int64]:
    """Where (J,) stretches or runs of rows begin, by their numbers (n,), of which neighbours have others."""
    return np.flatnonzero(np.diff(numbers, prepend=-1) != 0)


def stretch_sums(values: Array, stretch: NDArray[np.int64]) -> Array:
    """Sums (J,) or (J, k) of rows over stretches, whose numbers (n,) rise."""
    starts = starts_of(stretch)
    return np.asarray(np.add.reduceat(values, starts, axis=0)) if starts.size else np.zeros((0, *values.shape[1:]))


SILENT: Final = 1e-12
"""Rms, in whatever unit, of what leaves nothing at all, as ideal records do."""


def unit_of(baseline: Array, target: Array) -> float:
    """Rms of what a baseline leaves of a target: its unit, where other targets have others; 1 where nothing is left."""
    size = rms(target - baseline @ least_squares(baseline, target)) if target.size else 0.0
    return size if size > SILENT else 1.0


def least_squares(design: Array, target: Array) -> Array:
    """Coefficients (k,) or (k, m) of columns of any scale for a target (n,) or (n, m); of dependent ones, the least."""
    scale = np.linalg.norm(design, axis=0)
    scale[scale == 0] = 1.0
    return np.asarray(np.linalg.lstsq(design / scale, target, rcond=RANK)[0].T / scale).T

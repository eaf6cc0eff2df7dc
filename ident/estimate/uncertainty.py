"""Standard deviations that stay right under coloured residuals and repeated model error.

The estimate's error is Σ ψₜ eₜ with the influence ψ of each row, (Θᵀ Θ)⁻¹ Θᵀ for least squares. Three things make the
textbook σ²(Θᵀ Θ)⁻¹ too small: the residual is coloured (by the filter, by slow friction), its size differs between
steps, and model error repeats with every period of the excitation, so that more periods do not average it out. The
covariance is therefore estimated for every step and in two parts: what differs between periods (noise) and what repeats
(model error), each by its autocovariance. Every parameter has the degrees of freedom of its own variance, by Welch and
Satterthwaite.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from ident.estimate.repeat_noise import (
    Autocovariance,
    leverage,
    mean_of_repeats,
    noise_between,
    propagated,
    propagated_noise,
    shrinkage,
)
from ident.records.repeats import repeats_of

Array = NDArray[np.float64]

BLOCK_TIME = 0.02
"""Scores are summed over blocks of this length first [s], well below the filter's memory."""


SIGNIFICANCE = 0.95
"""Confidence with which a pattern must exceed the noise before it counts as repeated model error."""

_LEAST_LEFT = 0.1
"""Part of a variance that must be left in residuals for the rest to be concluded from it."""


@dataclass(frozen=True)
class FittedRows:
    """Rows of one coordinate of one segment as they were fitted.

    Attributes:
        regressor: (N, n).
        influence: ψ (N, n).
        residual: (N,).
        kept: (N,) rows that were fitted.
        period: (N,) number of the repeat, -1 outside of any.
        sample_time: [s].
    """

    regressor: Array
    influence: Array
    residual: Array
    kept: NDArray[np.bool_]
    period: NDArray[np.int64]
    sample_time: float


@dataclass(frozen=True)
class ErrorCovariance:
    """Covariance of an estimate's error.

    Attributes:
        matrix: (n, n).
        degrees_of_freedom: (n,) of the variances on its diagonal.
    """

    matrix: Array
    degrees_of_freedom: Array

    @classmethod
    def total(cls, parts: Sequence[Self]) -> Self:
        """Of the sum of independent errors, degrees of freedom by Welch and Satterthwaite."""
        matrix = np.sum([part.matrix for part in parts], axis=0)
        weights = np.sum(
            [np.diag(part.matrix) ** 2 / np.maximum(part.degrees_of_freedom, 1.0) for part in parts], axis=0
        )
        variances = np.diag(matrix)
        known = weights > 0
        return cls(matrix, np.where(known, variances**2 / np.where(known, weights, 1.0), np.inf))


def error_covariance(parts: Sequence[FittedRows]) -> ErrorCovariance:
    """Error covariance of an estimate that is linear in its rows; errors of different parts are independent.

    Args:
        parts: all rows of the fit.
    """
    return ErrorCovariance.total([found for part in parts for found in _of_part(part)])


def correlation_of(covariance: Array) -> Array:
    """(n, n) of a covariance; what is known exactly has none with anything else."""
    deviations = np.maximum(np.sqrt(np.diag(covariance)), np.finfo(float).tiny)
    found = covariance / deviations / deviations[:, None]
    np.fill_diagonal(found, 1.0)
    return np.asarray(found)


def interval_factor(degrees_of_freedom: float, level: float = 0.95) -> float:
    """Half-width of a two-sided interval in standard deviations (Student's t)."""
    return float(stats.t.ppf((1 + level) / 2, max(degrees_of_freedom, 1.0)))


def _of_part(part: FittedRows) -> list[ErrorCovariance]:
    regressor, influence = (np.where(part.kept[:, None], each, 0.0) for each in (part.regressor, part.influence))
    samples = repeats_of(part.period)
    if len(samples) < 2:
        return [_bartlett(_block_sums(influence * part.residual[:, None], part.sample_time))]
    residual, kept = part.residual[samples], np.asarray(part.kept[samples].all(axis=0))
    noise = noise_between(residual, kept)
    found = _positive(*propagated_noise(noise, influence, samples))
    pattern, taken = mean_of_repeats(residual, kept), leverage(influence[samples], regressor[samples])
    if not _repeats(noise.colour, pattern, taken[0]):
        return [found]
    with_noise = _unfitted(pattern, influence[samples].sum(axis=0), taken)
    repeated = _positive_part(with_noise.matrix - found.matrix)
    return [found, ErrorCovariance(repeated, with_noise.degrees_of_freedom)]


def _positive(matrix: Array, degrees: Array) -> ErrorCovariance:
    return ErrorCovariance(_positive_part(matrix), degrees)


def _unfitted(pattern: Autocovariance, influence: Array, taken: Array) -> ErrorCovariance:
    """Error by what repeats, from residuals from which a fit has taken its part and its degrees of freedom."""
    found = _positive(*propagated(pattern, influence))
    left = np.maximum(found.degrees_of_freedom - taken[0], 1.0)
    factor = np.sqrt(1 / np.maximum(shrinkage(pattern, influence, taken), _LEAST_LEFT))
    return ErrorCovariance(found.matrix * np.outer(factor, factor), left)


def _repeats(noise: Autocovariance, pattern: Autocovariance, fitted: float) -> bool:
    """Whether the mean period is larger than noise alone would leave it: an F test.

    Without the test, the noise of the mean period would be counted twice, and intervals under pure noise be
    needlessly wide.

    Args:
        fitted: parameters' worth of degrees of freedom that the fit has taken from the mean period.
    """
    rows = pattern.independent_rows
    left = max(rows - fitted, 1.0)
    limit = stats.f.ppf(SIGNIFICANCE, left, max(noise.independent_rows * noise.replicates, 1.0))
    mean_square = float(pattern.values[0]) * rows / left
    return (noise.replicates + 1) * mean_square > float(noise.values[0]) * float(limit)


def _positive_part(matrix: Array) -> Array:
    scale = np.sqrt(np.maximum(np.abs(np.diag(matrix)), np.finfo(float).tiny))
    values, vectors = np.linalg.eigh(matrix / np.outer(scale, scale))
    positive = (vectors * np.maximum(values, 0.0)) @ vectors.T
    return np.asarray(positive * np.outer(scale, scale))


def _block_sums(scores: Array, sample_time: float) -> Array:
    block = max(1, round(BLOCK_TIME / sample_time))
    starts = np.arange(0, len(scores), block)
    return np.asarray(np.add.reduceat(scores, starts, axis=0)) if len(scores) else scores


def _bartlett(blocks: Array) -> ErrorCovariance:
    """Newey-West covariance of the sum of the blocks (m, n), automatic bandwidth."""
    lag = _andrews_lag(blocks)
    total = blocks.T @ blocks
    for shift in range(1, lag + 1):
        product = blocks[shift:].T @ blocks[:-shift]
        total = total + (1 - shift / (lag + 1)) * (product + product.T)
    return ErrorCovariance(total, np.full(blocks.shape[1], 1.5 * len(blocks) / (lag + 1)))


def _andrews_lag(blocks: Array) -> int:
    """Bandwidth of the Bartlett kernel by an AR(1) plug-in, all columns in units of their own rms."""
    power = np.sum(blocks**2, axis=0)
    active = blocks[:, power > 0] / np.sqrt(power[power > 0])
    if not active.size or len(active) < 4:
        return 0
    correlation = np.clip(np.sum(active[1:] * active[:-1], axis=0), -0.97, 0.97)
    innovation = (1 - correlation**2) ** 2
    numerator = np.sum(4 * correlation**2 * innovation / ((1 - correlation) ** 6 * (1 + correlation) ** 2))
    denominator = np.sum(innovation / (1 - correlation) ** 4)
    lag = 1.1447 * (numerator / denominator * len(active)) ** (1 / 3)
    return int(min(np.ceil(lag), len(active) // 4))

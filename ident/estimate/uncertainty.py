"""Standard deviations that stay right under coloured residuals and repeated model error.

The estimate's error is (Θᵀ Θ)⁻¹ Σ xₜ eₜ. Three things make the textbook σ²(Θᵀ Θ)⁻¹ too small: the residual is
coloured (by the filter, by slow friction), its size differs between steps, and model error repeats with every
period of the excitation, so that more periods do not average it out. The long-run covariance of the scores
xₜ eₜ is therefore estimated in two parts: what differs between periods (noise), by a Bartlett kernel with
Andrews' automatic bandwidth (Andrews 1991, eq. 6.4), and what repeats (model error), from the period means.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from ident.records.repeats import repeats_of

Array = NDArray[np.float64]

BLOCK_TIME = 0.02
"""Scores are summed over blocks of this length first [s], well below the filter's memory."""


SIGNIFICANCE = 0.95
"""Confidence with which a pattern must exceed the noise before it counts as repeated model error."""


@dataclass(frozen=True)
class Scores:
    """xₜ eₜ of one coordinate of one segment, zero in dropped rows.

    Attributes:
        values: (N, n).
        period: (N,) number of the repeat, -1 outside of any.
        sample_time: [s].
    """

    values: Array
    period: NDArray[np.int64]
    sample_time: float


@dataclass(frozen=True)
class LongRun:
    """Covariance of a sum of scores, and the degrees of freedom of that estimate."""

    covariance: Array
    degrees_of_freedom: float


def long_run_covariance(parts: Sequence[Scores]) -> LongRun:
    """Covariance (n, n) of Σ xₜ eₜ over independent parts."""
    estimates = [estimate for part in parts for estimate in _of_part(part)]
    total = np.sum([estimate.covariance for estimate in estimates], axis=0)
    return LongRun(total, _combined_degrees(estimates, total))


def parameter_covariance(normal_inverse: Array, scores: LongRun) -> Array:
    """Sandwich (Θᵀ Θ)⁻¹ S (Θᵀ Θ)⁻¹, (n, n)."""
    return np.asarray(normal_inverse @ scores.covariance @ normal_inverse)


def interval_factor(degrees_of_freedom: float, level: float = 0.95) -> float:
    """Half-width of a two-sided interval in standard deviations (Student's t)."""
    return float(stats.t.ppf((1 + level) / 2, max(degrees_of_freedom, 1.0)))


def _combined_degrees(estimates: Sequence[LongRun], total: Array) -> float:
    """Welch-Satterthwaite on the traces, each column in units of its own total variance."""
    unit = np.maximum(np.diag(total), np.finfo(float).tiny)
    shares = [float(np.mean(np.diag(estimate.covariance) / unit)) for estimate in estimates]
    weight = sum(share**2 / estimate.degrees_of_freedom for share, estimate in zip(shares, estimates, strict=True))
    return 1.0 / weight if weight > 0 else np.inf


def _of_part(part: Scores) -> list[LongRun]:
    outside = part.values[part.period < 0]
    folded = _fold(part)
    if folded is None:
        return [_bartlett(_block_sums(part.values, part.sample_time))]
    estimates = _of_periods(folded, part.sample_time)
    return [*estimates, _bartlett(_block_sums(outside, part.sample_time))] if np.any(outside) else estimates


def _fold(part: Scores) -> Array | None:
    """Scores by period (P, T, n), or None for fewer than two repeats."""
    samples = repeats_of(part.period)
    return part.values[samples] if len(samples) > 1 else None


def _of_periods(folded: Array, sample_time: float) -> list[LongRun]:
    """Noise from the differences between periods; repeated model error from their mean."""
    periods = len(folded)
    mean = folded.mean(axis=0)
    deviations = np.concatenate([_block_sums(period - mean, sample_time) for period in folded])
    noise = _bartlett(deviations)
    noise_total = noise.covariance * periods / (periods - 1)
    degrees = noise.degrees_of_freedom * (periods - 1) / periods
    found = [LongRun(noise_total, degrees)]
    if _repeats(folded, noise.degrees_of_freedom):
        pattern = _prewhitened(_block_sums(mean, sample_time))
        repeated = _positive_part(periods**2 * pattern.covariance - noise_total)
        found.append(LongRun(repeated, pattern.degrees_of_freedom))
    return found


def _repeats(folded: Array, degrees: float) -> bool:
    """Whether the mean period (P, T, n) is larger than noise alone would leave it: an F test.

    Without the test, the noise of the mean period would be counted twice, and intervals under pure noise be half as
    wide again as they need to be.
    """
    periods = len(folded)
    between = folded.var(axis=0, ddof=1).mean(axis=0)
    pattern = np.mean(folded.mean(axis=0) ** 2, axis=0)
    driven = pattern > 0
    smallest = np.finfo(float).eps * pattern[driven]
    ratio = periods * float(np.mean(pattern[driven] / np.maximum(between[driven], smallest))) if driven.any() else 0.0
    return ratio > float(stats.f.ppf(SIGNIFICANCE, degrees / periods, degrees * (periods - 1) / periods))


def _positive_part(matrix: Array) -> Array:
    scale = np.sqrt(np.maximum(np.abs(np.diag(matrix)), np.finfo(float).tiny))
    values, vectors = np.linalg.eigh(matrix / np.outer(scale, scale))
    positive = (vectors * np.maximum(values, 0.0)) @ vectors.T
    return np.asarray(positive * np.outer(scale, scale))


def _block_sums(scores: Array, sample_time: float) -> Array:
    block = max(1, round(BLOCK_TIME / sample_time))
    starts = np.arange(0, len(scores), block)
    return np.asarray(np.add.reduceat(scores, starts, axis=0)) if len(scores) else scores


def _prewhitened(blocks: Array) -> LongRun:
    """Bartlett on AR(1)-whitened blocks, recoloured (Andrews and Monahan 1992).

    The mean period is short, and the fit has taken from it what lies along the regressor: its sum is zero. Without
    whitening the kernel then finds 0.6 to 0.8 of the true spread.
    """
    power = np.sum(blocks[:-1] ** 2, axis=0)
    memory = np.sum(blocks[1:] * blocks[:-1], axis=0) / np.maximum(power, np.finfo(float).tiny)
    memory = np.clip(memory, -0.97, 0.97)
    whitened = _bartlett(np.vstack([blocks[:1], blocks[1:] - memory * blocks[:-1]]))
    colour = 1 / (1 - memory)
    slowest = float(np.abs(memory).max())
    degrees = whitened.degrees_of_freedom * (1 - slowest) / (1 + slowest)
    return LongRun(whitened.covariance * np.outer(colour, colour), degrees)


def _bartlett(blocks: Array) -> LongRun:
    """Newey-West covariance of the sum of the blocks (m, n), automatic bandwidth."""
    lag = _andrews_lag(blocks)
    total = blocks.T @ blocks
    for shift in range(1, lag + 1):
        product = blocks[shift:].T @ blocks[:-shift]
        total = total + (1 - shift / (lag + 1)) * (product + product.T)
    return LongRun(total, 1.5 * len(blocks) / (lag + 1))


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

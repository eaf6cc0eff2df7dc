"""Noise as the differences between repeats show it, carried through the regressor as it was driven.

A parameter's error is Σ ψₜ eₜ, ψ being its influence: its row of (Θᵀ Θ)⁻¹ Θᵀ. Under noise of autocovariance γ its
variance is Σ g(h) γ(h) over all lags h, with g(h) = Σ ψₜ ψₜ₊ₕ. The regressor, and so g, is known exactly; γ is
estimated from what differs between repeats, in which neither the fit nor model error has a part. No bandwidth has to be
chosen: g fades out by itself. The estimate is quadratic in the noise, hence distributed nearly as χ², and its degrees
of freedom follow from g and γ.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.fft import irfft, next_fast_len, rfft

Array = NDArray[np.float64]

WINDOW_ROWS = 10
"""Independent differences by which the size of the noise at a phase is estimated."""

_ROUNDING = 1e-9
"""Part of all pairs below which there is none."""

_TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Autocovariance:
    """Estimated autocovariance of an error of one coordinate of one step.

    Attributes:
        values: (T,) γ(h), tapered to nothing at h = T.
        pairs: (T,) how many pairs of kept samples are h apart, each counted by the product of its intensities.
        counts: (T,) the same, each counted once.
        taper: (T,) what γ(h) was multiplied by.
        replicates: independent series of T samples that it was estimated from.
    """

    values: Array
    pairs: Array
    counts: Array
    taper: Array
    replicates: int

    @property
    def independent_rows(self) -> float:
        """White samples whose mean square would scatter as that of one series."""
        total = self.counts[0] * self.values[0]
        return float(total**2 / max(_two_sided(self.counts * self.values**2), _TINY))


@dataclass(frozen=True)
class RepeatNoise:
    """Noise whose size depends on the phase of a repeat, and whose colour does not.

    Attributes:
        colour: autocovariance of the noise over its intensity.
        intensity: (T,) its size at every phase, mean square 1 over those kept.
        kept: (T,) phases that count.
        window: samples over which the intensity was averaged.
    """

    colour: Autocovariance
    intensity: Array
    kept: NDArray[np.bool_]
    window: int


def noise_between(residual: Array, kept: NDArray[np.bool_]) -> RepeatNoise:
    """Noise by what differs between P repeats of T samples, residual (P, T); `kept` (T,) are the phases that count."""
    differences, replicates = residual - residual.mean(axis=0), len(residual) - 1
    uniform = _autocovariance(differences, kept.astype(float), replicates)
    rows = max(uniform.independent_rows, 1.0)
    window = max(1, min(round(WINDOW_ROWS * uniform.pairs[0] / (rows * replicates)), residual.shape[1]))
    # A running mean of squares may end below zero by rounding.
    sizes = _windowed(np.where(kept, np.sum(differences**2, axis=0), 0.0), kept, window)
    power = np.maximum(sizes, 0.0)
    mean = float(power[kept].mean()) if kept.any() else 0.0
    intensity = np.sqrt(power / mean) * kept if mean > 0 else kept.astype(float)
    return RepeatNoise(_autocovariance(differences, intensity, replicates), intensity, kept, window)


def propagated_noise(noise: RepeatNoise, influence: Array, samples: NDArray[np.int64]) -> tuple[Array, Array]:
    """As `propagated`, for noise as strong as at the phase of every row.

    Args:
        influence: (N, n) ψ, zero in dropped rows.
        samples: (P, T) rows of every repeat, one phase a column.
    """
    strength = np.ones(len(influence))
    strength[samples] = np.where(noise.kept, noise.intensity, 1.0)
    scaled = influence * strength[:, None]
    covariance, degrees = propagated(noise.colour, scaled)
    size = next_fast_len(len(scaled) + len(noise.intensity), real=True)
    spectrum = rfft(_circular(noise.colour.values, size)).real
    shares = scaled * irfft(rfft(scaled, size, axis=0) * spectrum[:, None], size, axis=0)[: len(scaled)]
    by_phase = shares[samples].sum(axis=0).T
    return covariance, np.array([_with_intensity(noise, *pair) for pair in zip(degrees, by_phase, strict=True)])


def _with_intensity(noise: RepeatNoise, degrees: float, shares: Array) -> float:
    """Degrees of freedom when the size at every phase is estimated as well, `shares` being what each adds (T,).

    Those of one size for all phases are part of `degrees`; those of the windows that matter take their place.
    """
    colour = noise.colour
    all_phases = colour.replicates * colour.independent_rows
    spread = _windowed_back(shares, noise.kept, noise.window)
    concentration = float(noise.kept.sum()) * float(np.sum(spread**2)) / max(float(shares.sum()) ** 2, _TINY)
    return float(1 / max(1 / max(degrees, _TINY) + (concentration - 1) / max(all_phases, 1.0), _TINY))


def _windowed(values: Array, kept: NDArray[np.bool_], window: int) -> Array:
    """Mean of the kept values within a window around each, (T,); repeats join end to start."""
    return np.asarray(_box(values, window) / np.maximum(_box(kept.astype(float), window), 1 / window))


def _windowed_back(shares: Array, kept: NDArray[np.bool_], window: int) -> Array:
    """Adjoint of `_windowed`: what every kept value has in a sum of means with these weights, (T,)."""
    return np.where(kept, _box(shares / np.maximum(_box(kept.astype(float), window), 1 / window), window), 0.0)


def _box(values: Array, window: int) -> Array:
    return np.asarray(ndimage.uniform_filter1d(values, 2 * (window // 2) + 1, mode="wrap"))


def mean_of_repeats(residual: Array, kept: NDArray[np.bool_]) -> Autocovariance:
    """Of the mean of the repeats: what repeats, and what is left of the noise."""
    return _autocovariance(residual.mean(axis=0)[None], kept.astype(float), 1)


def _autocovariance(series: Array, intensity: Array, replicates: int) -> Autocovariance:
    """Of series (R or more, T) over their intensity (T,), which is zero where they do not count."""
    length = len(intensity)
    pairs = _autocorrelation(intensity[:, None], length)[:, 0]
    counts = _autocorrelation((intensity[:, None] > 0).astype(float), length)[:, 0]
    known = pairs > _ROUNDING * pairs[0]
    products = _autocorrelation(np.where(intensity > 0, series, 0.0).T, length).sum(axis=1) / replicates
    # γ(h) by few pairs is worth little. The triangle costs the variance what the noise's memory is of a repeat.
    taper = np.where(known, 1 - np.arange(length) / length, 0.0)
    return Autocovariance(taper * products / np.where(known, pairs, 1.0), pairs, counts, taper, replicates)


def propagated(error: Autocovariance, influence: Array) -> tuple[Array, Array]:
    """Covariance (n, n) of Σ ψₜ eₜ, and the degrees of freedom (n,) of its diagonal.

    Args:
        influence: (N, n) ψ, zero in dropped rows.
    """
    length = len(error.values)
    size = next_fast_len(len(influence) + length, real=True)
    waves = rfft(influence, size, axis=0)
    spectrum = rfft(_circular(error.values, size)).real
    weights = spectrum * np.where((np.arange(len(spectrum)) == 0) | (2 * np.arange(len(spectrum)) == size), 1.0, 2.0)
    covariance = np.einsum("fi,fj,f->ij", waves.conj(), waves, weights, optimize=True).real / size
    own = irfft(np.abs(waves) ** 2, size, axis=0)[:length]
    return np.asarray(covariance), np.array([_degrees_of_freedom(error, column) for column in own.T])


def leverage(influence: Array, regressor: Array) -> Array:
    """What a fit takes from products of residuals h apart, in units of a white error's variance, (T,).

    Args:
        influence, regressor: (P, T, n), zero in dropped rows; the first is (Θᵀ Θ)⁻¹ Θᵀ transposed.
    """
    length = influence.shape[1]
    size = next_fast_len(2 * length, real=True)
    waves = rfft(influence, size, axis=1).conj() * rfft(regressor, size, axis=1)
    return np.asarray(irfft(waves.sum(axis=(0, 2)).real, size)[:length])


def shrinkage(error: Autocovariance, influence: Array, taken: Array) -> Array:
    """Which part of the variance of Σ ψₜ eₜ is left in residuals that a fit has taken `taken` (T,) from, (n,).

    As in the corrections of White's estimate for leverage (Bell and McCaffrey 2002), for an error that is white.

    Args:
        influence: (T, n) ψ, zero in dropped rows.
    """
    own = _autocorrelation(influence, len(taken))
    lost = error.taper * taken / np.maximum(error.pairs, _ROUNDING * error.pairs[0] + _TINY)
    return np.array([1 - _two_sided(lost * column) / max(column[0], _TINY) for column in own.T])


def _degrees_of_freedom(error: Autocovariance, own: Array) -> float:
    """2 E² / Var of Σ g(h) γ̂(h), `own` being g(h) (T,); Var = 2 tr((C Γ)²)/R of R replicates, γ̂ in the place of γ.

    The square of a spectrum that R replicates show is (R + 1)/R times too large in the mean, hence R + 1.
    """
    length = len(own)
    size = next_fast_len(4 * length, real=True)
    kernel = own * error.taper / np.maximum(error.counts, 1.0)
    product = irfft(rfft(_circular(kernel, size)).real * rfft(_circular(error.values, size)).real, size)[:length]
    variance = _two_sided(own * error.values)
    return (error.replicates + 1) * variance**2 / max(_two_sided(error.counts * product**2), _TINY)


def _autocorrelation(columns: Array, length: int) -> Array:
    """Σ xₜ xₜ₊ₕ of every column (N, n) at lags 0 ... length - 1, (length, n)."""
    size = next_fast_len(len(columns) + length, real=True)
    return np.asarray(irfft(np.abs(rfft(columns, size, axis=0)) ** 2, size, axis=0)[:length])


def _circular(one_sided: Array, size: int) -> Array:
    """An even function of the lag, (size,), by its values at lags from 0 on."""
    found = np.zeros(size)
    found[: len(one_sided)] = one_sided
    found[size - len(one_sided) + 1 :] = one_sided[:0:-1]
    return found


def _two_sided(one_sided: Array) -> float:
    """Sum over negative and positive lags of an even function."""
    return float(2 * one_sided.sum() - one_sided[0])

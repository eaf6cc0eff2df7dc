"""What the rows say for each candidate: likelihood ratios beside the baseline, and surrogates to measure them against.

A candidate's columns are first made orthogonal to the whitened baseline: what the parameters of the model can absorb is
no evidence. Under no effect, the signs of stretches of the whitened residual are arbitrary; flipping them at random
gives the distribution of the largest ratio over all candidates (max statistic, so that many candidates cost what they
must) and the factor by which a candidate's ratio scatters more than white noise would make it. Repeats have been
averaged before, so that what repeats keeps repeating in a surrogate.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.directions import Directions, White, directions
from ident.diagnosis.linear import orthonormal, stretch_sums
from ident.diagnosis.rows import Column

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

BESIDE: Final = 4.0
"""Log evidence that what comes along with an effect must bring more than the price of its number: few effects do not
come alone, one in fifty by this."""


@dataclass(frozen=True)
class Evidence:
    """Evidence for every variant on top of a baseline.

    Attributes:
        directions: what each variant adds.
        amplitudes: (D,) of the residual along the directions.
        surrogates: (M, D) the same, signs of stretches flipped, the best candidate taken away before.
        scale: (V,) how much more than white noise the ratio scatters, at least 1; the variant itself taken away before.
            Variants that point where the best one does have its scale: what tells them apart is the fit, not the noise.
        log_evidence: (V,) half the scaled ratio, less the price of its coefficients; -inf where nothing is visible.
        log_predictive: (V,) log Bayes factor of the confirming rows, given the fitted ones; 0 without any.
        confirming: (V,) share of the confirming rows in the power of what each variant adds, as it was fitted.
        significance: probability of so large a maximum over all variants without any effect.
    """

    directions: Directions
    amplitudes: Array
    surrogates: Array
    scale: Array
    log_evidence: Array
    log_predictive: Array
    confirming: Array
    significance: float

    def explained(self, variant: int) -> Array:
        """What a variant explains of the whitened rows (n,), beside the baseline."""
        return _explained(self.directions, self.amplitudes, variant)


def gather(white: White, layout: Sequence[Column], signs: Array, excluded: Mask) -> Evidence:
    """Evidence for every variant.

    Args:
        white: the regression.
        layout: of its columns.
        signs: (M, J) of +1 and -1, one a stretch.
        excluded: (V,) variants that do not compete.
    """
    found = directions(white, layout)
    amplitudes = found.basis.T @ found.residual
    sizes = found.sizes
    ratios = found.ratios(amplitudes)
    own = 0.5 * _own(white, layout, found, amplitudes)
    competing = (ratios > 0) & ~excluded
    best = int(np.argmax(np.where(competing, ratios, -1.0)))
    surrogates = signs @ stretch_sums(found.basis * _without(found, amplitudes, best)[:, None], white.stretch)
    scale = _shared(found, amplitudes, best, _scatters(found, amplitudes, white.stretch))
    spread = np.maximum(found.ratios(surrogates).mean(axis=0) / np.maximum(sizes, 1), 1.0)
    beside = np.minimum([column.beside for column in layout], np.maximum(sizes - 1, 0))
    price = 0.5 * sizes * math.log(len(white.target))
    price += BESIDE * beside + np.array([column.price for column in layout])
    price = price[origins(layout)]
    tested = np.where(competing, 0.5 * ratios / spread - price, -np.inf)
    by_chance = np.where((sizes > 0) & ~excluded, 0.5 * found.ratios(surrogates) / spread - price, -np.inf)
    competing &= own / scale > 0.5 * (sizes - beside) * math.log(len(white.target))
    return Evidence(
        directions=found,
        amplitudes=amplitudes,
        surrogates=surrogates,
        scale=scale,
        log_evidence=np.where(competing, 0.5 * ratios / scale - price, -np.inf),
        log_predictive=_in_turn(white, layout, found, amplitudes, scale),
        confirming=_confirming(white, layout, found, amplitudes),
        significance=significance(tested.max(initial=-np.inf), by_chance.max(axis=1, initial=-np.inf)),
    )


def origins(layout: Sequence[Column]) -> NDArray[np.int64]:
    """The variant (V,) that each is the shape of, or itself."""
    of = [index if column.shape_of is None else column.shape_of for index, column in enumerate(layout)]
    return np.array(of, dtype=np.int64)


def _explained(found: Directions, amplitudes: Array, variant: int) -> Array:
    place = found.places[variant]
    return np.asarray(found.basis[:, place] @ amplitudes[place])


def _without(found: Directions, amplitudes: Array, variant: int) -> Array:
    return np.asarray(found.residual - _explained(found, amplitudes, variant))


def scatter(basis: Array, residual: Array, stretch: NDArray[np.int64]) -> float:
    """Mean ratio along orthonormal directions (n, k) over all signs of the stretches, the directions taken off before.

    It is in units of that of white noise, and at least 1.
    """
    if not basis.shape[1]:
        return 1.0
    sums = stretch_sums(basis * (residual - basis @ (basis.T @ residual))[:, None], stretch)
    return float(max(1.0, np.sum(sums**2) / basis.shape[1]))


def _scatters(found: Directions, amplitudes: Array, stretch: NDArray[np.int64]) -> Array:
    """Of the directions of every variant (V,); those of one direction at once."""
    sizes = found.sizes
    alone = np.flatnonzero(sizes == 1)
    places = [found.places[variant].start for variant in alone.tolist()]
    basis = found.basis[:, places]
    sums = stretch_sums(basis * (found.residual[:, None] - basis * amplitudes[places]), stretch)
    scale = np.ones(len(found.places))
    scale[alone] = np.maximum(1.0, np.sum(sums**2, axis=0))
    for variant in np.flatnonzero(sizes > 1).tolist():
        scale[variant] = scatter(found.basis[:, found.places[variant]], found.residual, stretch)
    return scale


def significance(found: float, by_chance: Array) -> float:
    """Probability of a value as large as the one found, from values (M,) of surrogates."""
    return float((1 + np.sum(by_chance >= found)) / (1 + len(by_chance)))


def _shared(found: Directions, amplitudes: Array, best: int, scale: Array) -> Array:
    """Scale (V,) of every variant, that of the best one as far as either explains what the other does."""
    alike = np.maximum(_overlap(found, amplitudes, best), _within(found, amplitudes, best))
    return np.asarray(scale + alike * (scale[best] - scale))


def _within(found: Directions, amplitudes: Array, variant: int) -> Array:
    """Share (V,) of the square of what every variant explains that one of them can explain too."""
    towards = amplitudes[:, None] * (found.basis.T @ found.basis[:, found.places[variant]])
    sums = np.vstack([np.zeros((1, towards.shape[1])), np.cumsum(towards, axis=0)])
    starts, stops = ([getattr(place, end) for place in found.places] for end in ("start", "stop"))
    covered = np.sum((sums[stops] - sums[starts]) ** 2, axis=1)
    whole = np.maximum(found.lengths(amplitudes), np.finfo(float).tiny)
    return np.asarray(np.minimum(covered / whole, 1.0))


def _overlap(found: Directions, amplitudes: Array, variant: int) -> Array:
    """Share (V,) of the square of what one variant explains that every other can explain too."""
    fitted = _explained(found, amplitudes, variant)
    share = found.lengths(found.basis.T @ fitted) / max(float(fitted @ fitted), np.finfo(float).tiny)
    return np.asarray(np.minimum(share, 1.0))


def _in_turn(white: White, layout: Sequence[Column], found: Directions, amplitudes: Array, scale: Array) -> Array:
    """What the confirming rows add (V,) to half the scaled ratio of the fitted ones.

    The coefficients are known from the fit as well as it shows them. For Gaussian noise and flat priors the factor is
    half the gain of the likelihood ratio less half the gain of the log-determinant: a coefficient that the fit got
    wrong predicts the confirming rows worse than none.
    """
    if not white.confirming.any():
        return np.zeros(len(layout))
    fitted = directions(white, layout, ~white.confirming)
    gained = found.ratios(amplitudes) - fitted.ratios(fitted.basis.T @ fitted.residual)
    return np.asarray(0.5 * gained / scale - 0.5 * (found.volume - fitted.volume))


def _confirming(white: White, layout: Sequence[Column], found: Directions, amplitudes: Array) -> Array:
    """Share (V,) of the confirming rows in the power of what every variant adds, as it was fitted."""
    squares = white.columns**2
    part, whole = squares[white.confirming].sum(axis=0), squares.sum(axis=0)
    shares = part / np.maximum(whole, np.finfo(float).tiny)
    share = np.zeros(len(layout))
    for variant, (column, place) in enumerate(zip(layout, found.places, strict=True)):
        if column.width == 1 and place.stop > place.start:
            share[variant] = shares[column.place.start]
        elif place.stop > place.start:
            columns = white.columns[:, column.place]
            coefficients = np.linalg.lstsq(found.basis[:, place].T @ columns, amplitudes[place], rcond=None)[0]
            power = (columns @ coefficients) ** 2
            share[variant] = power[white.confirming].sum() / max(power.sum(), np.finfo(float).tiny)
    return share


def _own(white: White, layout: Sequence[Column], found: Directions, amplitudes: Array) -> Array:
    """What every variant (V,) has of its ratio beside what comes along with the effect."""
    own = found.lengths(amplitudes)
    for variant, (column, place) in enumerate(zip(layout, found.places, strict=True)):
        if column.beside and column.itself and place.stop > place.start:
            along = white.columns[:, column.own.stop : column.place.stop]
            base = orthonormal(found.basis[:, place].T @ along)
            amplitude = amplitudes[place] - base @ (base.T @ amplitudes[place])
            own[variant] = amplitude @ amplitude
    return own


def cosines(evidence: Evidence, index: int) -> Array:
    """Cosine between what one variant explains and what every other can (V,), 0 where nothing is visible."""
    found = evidence.directions
    return np.sqrt(_overlap(found, evidence.amplitudes, index))

"""Noise of the rows: what differs between repeats, and what a model may lack beside it.

Rows of a block have the covariance R + t tᵀ ∘ C. R is that of the mean over the repeats, by what differs between them;
without any, that of what the baseline and the strongest candidates leave, or a set that was found (`Left`). t is what a
model may have wrong at most in each row (`Block.tolerance`, and where something repeats `Block.tolerated`), a process
that remembers, as slow as the motion or faster. Where the rows say so, more is lacking: q times as much as noise and
tolerance are together in each row, of the same memory. There is one q for all blocks of a step and a coordinate, the
most likely beside the hypotheses that are taken; each next one has a price.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from itertools import product
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from ident.diagnosis.observations.linear import ROUNDING, rms
from ident.diagnosis.observations.regression import Regression
from ident.diagnosis.observations.rows import Kept, Rows
from ident.diagnosis.observations.whitening import Left, Predictor, Whitener, colours_of, predictor_of, whitener_of
from ident.diagnosis.problem import Block

Array = NDArray[np.float64]
Sizes = tuple[int, ...]
"""Of what is lacking, by label: number among `SIZES`."""

SIZES: Final = (0.0, 1.0, 3.0, 10.0, 30.0, 100.0)
"""Of what is lacking, over noise and tolerance."""

USUAL: Final = 0
"""Number of nothing among them."""

PRICE: Final = 2.0
"""Log odds against the next of them: one in seven."""

MEMORIES: Final = (0.1, 0.5, 2.0)
"""Of what a model lacks [s], a third of its power each: contacts and friction have it at every one."""

ROUNDS: Final = 4
"""Times that the sizes of all labels are looked at."""


class Colours:
    """Covariances of the rows of every block.

    Args:
        regression: of the rows.
        left: what a set leaves of them; None: nothing is known of what is there yet.

    Attributes:
        rows: of the problems.
        labels: channel, step and coordinate, of blocks that share what they lack.
        blocks: numbers of the blocks, by label.
        places: rows of every block that has some.
        kept: those blocks, and which of their samples became rows.
        stretch: (n,) number of the stretch that every row belongs to, rising.
    """

    def __init__(self, regression: Regression, left: Left | None = None) -> None:
        self.rows: Rows = regression.rows
        self.stretch = regression.stretch
        found: dict[str, list[int]] = {}
        self.places: list[slice] = []
        self.kept: list[tuple[Block, Kept]] = []
        self._tolerated: list[Array] = []
        self._lacking: list[Array] = []
        alone = None if self.repeats(regression) else _of(regression, left)
        for (block, kept), place in zip(self.rows.blocks, self.rows.block_slices, strict=True):
            if place.stop == place.start:
                continue
            found.setdefault(f"{block.channel}/{block.label}", []).append(len(self.places))
            group = int(self.rows.group[place.start])
            colour = regression.repeats[group]
            time = kept.samples[0] * block.sample_time
            memory = _remembering(np.abs(np.subtract.outer(time, time)))
            # What nothing that repeats tells apart has what is tolerated in it.
            predictor = predictor_of(colour) if alone is None or colour.count else alone.predictors[group]
            tolerated = _of_sizes(kept.mean(block.tolerances), memory) if colour.count else np.zeros_like(memory)
            # A white share, so that a band without any power is not blown up.
            least = (ROUNDING * rms(self.rows.target[place])) ** 2 * np.eye(len(memory))
            noise = _covariance(predictor, self.rows.run[place]) + least
            self.places.append(place)
            self.kept.append((block, kept))
            self._tolerated.append(noise + tolerated)
            self._lacking.append(_of_sizes(np.sqrt(np.diag(self._tolerated[-1])), memory))
        self.labels = tuple(found)
        self.blocks = tuple(tuple(numbers) for numbers in found.values())
        self._factors: dict[tuple[int, int], Array] = {}

    @staticmethod
    def repeats(regression: Regression) -> bool:
        """Whether what differs between repeats tells the noise of all rows."""
        return all(colour.count for colour in regression.repeats)

    @cached_property
    def rows_of_labels(self) -> tuple[NDArray[np.int64], ...]:
        """Numbers of the rows of every label."""
        places = [[self.places[number] for number in numbers] for numbers in self.blocks]
        return tuple(np.concatenate([np.arange(one.start, one.stop) for one in own]) for own in places)

    @property
    def usual(self) -> Sizes:
        """Nothing is lacking but what is tolerated."""
        return (USUAL,) * len(self.labels)

    def white(self, values: Array, sizes: Sizes) -> tuple[Array, float]:
        """All rows (n, k) in units of the noise, and half the log of its determinant."""
        found, volume = np.array(values, dtype=float), 0.0
        for label, size in enumerate(sizes):
            for number in self.blocks[label]:
                place = self.places[number]
                found[place], more = self.of_block(number, size, found[place])
                volume += more
        return found, volume

    def of_label(self, label: int, size: int, values: Array) -> tuple[Array, float]:
        """White rows of a label alone, of values (n, k) of all rows; and half the log of the determinant."""
        made = [self.of_block(number, size, values[self.places[number]]) for number in self.blocks[label]]
        return np.vstack([white for white, _ in made]), sum(volume for _, volume in made)

    def weighted(self, sizes: Sizes, values: Array) -> Array:
        """Rows (n, k) times the inverse of their covariance."""
        found = np.array(values, dtype=float)
        for label, size in enumerate(sizes):
            for number in self.blocks[label]:
                place = self.places[number]
                found[place] = linalg.cho_solve((self._factor(number, size), True), found[place], check_finite=False)
        return found

    def of_block(self, number: int, size: int, values: Array) -> tuple[Array, float]:
        """White rows of a block, of values (m, k) of its rows; and half the log of the determinant."""
        factor = self._factor(number, size)
        white = linalg.solve_triangular(factor, values, lower=True, check_finite=False)
        return white, float(np.sum(np.log(np.diag(factor))))

    def _factor(self, number: int, size: int) -> Array:
        """(n, n) lower triangular, of the covariance of a block."""
        if (number, size) not in self._factors:
            whole = self._tolerated[number] + SIZES[size] ** 2 * self._lacking[number]
            whole += ROUNDING * np.trace(whole) / len(whole) * np.eye(len(whole))
            self._factors[number, size] = linalg.cholesky(whole, lower=True, check_finite=False)
        return self._factors[number, size]


@dataclass(frozen=True)
class Noise:
    """The noise of all rows, as what turns them into white ones (`Whitener` of the refit and of laws).

    Attributes:
        colours: of the rows.
        sizes: of what is lacking, by label.
    """

    colours: Colours
    sizes: Sizes

    def apply(self, rows: Rows, values: Array) -> Array:
        """Whitened copy of (n,) or (n, k)."""
        del rows
        columns = values[:, None] if np.ndim(values) == 1 else values
        return self.colours.white(columns, self.sizes)[0].reshape(np.shape(values))


def price_of(sizes: Sizes) -> float:
    """Log odds against so much being lacking."""
    return PRICE * sum(sizes)


def most_likely(colours: Colours, columns: Array, target: Array, known: Array, start: Sizes) -> Sizes:
    """Sizes of what is lacking, by label, that are the most likely.

    One label after the other, since what a coefficient is in one step holds in all. Of each, the next size as long as
    that is likelier: the likelihood of a size is taken to have one maximum.

    Args:
        colours: of the rows.
        columns: (n, k) each with a coefficient of unit variance.
        target: (n,).
        known: (k + 1, k + 1) products of rows beside those of the records, the target last.
        start: sizes to begin with.
    """
    whole = np.column_stack([columns, target])

    @cache
    def part(label: int, size: int) -> tuple[Array, float]:
        white, volume = colours.of_label(label, size, whole)
        return white.T @ white, volume

    found = list(start)
    products = known + np.sum([part(*one)[0] for one in enumerate(found)], axis=0)
    log = _log(products)
    for _ in range(ROUNDS):
        before = tuple(found)
        for label, step in product(range(len(found)), (1, -1)):
            while 0 <= (size := found[label] + step) < len(SIZES):
                (now, now_volume), (other, volume) = part(label, found[label]), part(label, size)
                changed = products - now + other
                beside = _log(changed)
                if beside - log + now_volume - volume <= PRICE * step:
                    break
                products, log, found[label] = changed, beside, size
        if tuple(found) == before:
            break
    return tuple(found)


def _log(products: Array) -> float:
    """Log likelihood of white rows by their products (k + 1, k + 1), the target last, coefficients integrated."""
    width = len(products) - 1
    inner = np.eye(width) + products[:width, :width]
    factor = linalg.cholesky(inner, lower=True, check_finite=False)
    explained = linalg.solve_triangular(factor, products[:width, width], lower=True, check_finite=False)
    return -0.5 * float(products[width, width] - explained @ explained) - float(np.sum(np.log(np.diag(factor))))


def _of(regression: Regression, left: Left | None) -> Whitener:
    """Noise of rows without repeats: of what a set leaves, or the parameters and the strongest candidates."""
    if left is None:
        left = regression.left_beside(regression.columns_of(regression.strongest))
    return whitener_of(regression.rows, colours_of(regression.rows, left))


def _of_sizes(deviations: Array, correlation: Array) -> Array:
    """Covariance (m, m) of what has these deviations (m,)."""
    return np.asarray(np.outer(deviations, deviations) * correlation)


def _remembering(distance: Array) -> Array:
    """Correlation at distances in time [s]."""
    return np.asarray(np.mean([np.exp(-distance / memory) for memory in MEMORIES], axis=0))


def _covariance(predictor: Predictor, runs: NDArray[np.int64]) -> Array:
    """(n, n) of the noise of a block, by an autoregression; uninterrupted runs are independent."""
    found = np.zeros((len(runs), len(runs)))
    for run in np.unique(runs):
        place = np.flatnonzero(runs == run)
        back = linalg.solve_triangular(predictor.apply(np.eye(len(place))), np.eye(len(place)), lower=True)
        found[np.ix_(place, place)] = back @ back.T
    return found

"""The rows as one whitened regression: the colour of its noise, and what is known beforehand of its parameters."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.observations.autoregression import ORDER
from ident.diagnosis.observations.directions import Directions, White, directions
from ident.diagnosis.observations.linear import least_squares, unit_of
from ident.diagnosis.observations.rows import Rows
from ident.diagnosis.observations.whitening import (
    Colour,
    Left,
    Whitener,
    Whitening,
    colours_of_repeats,
    fit_whitener,
)
from ident.diagnosis.problem import Problem, Series

Array = NDArray[np.float64]

Mask = NDArray[np.bool_]

LARGE: Final = 0.1
"""Part of the sum of squares, colour apart, from which a candidate is taken off too: whitening can hide it."""

ROWS_PER_CONTENDER: Final = 40

CONTENDING: Final = 12.0
"""Likelihood ratio from which a candidate is taken off: what chance alone seldom reaches is not taken for noise."""

CONTENDERS: Final = 12
"""Candidates that are taken off before the colour of the noise is found."""

STRETCH: Final = 30
"""Rows of a stretch, well beyond the memory of whitened rows: what scatters over them is as good as independent."""

STRETCHES: Final = 24
"""That there shall be at least; short records have shorter ones."""


class Regression:
    """Rows of the problems, and the colour of their noise.

    Attributes:
        problem: that was posed of the fitted records.
        rows: of both problems.
        stretch: (n,) number of the stretch of a run that a row belongs to.
    """

    def __init__(self, problem: Problem, rows: Rows) -> None:
        self.problem, self.rows = problem, rows
        self.stretch = _stretches(rows, max(1, min(STRETCH, len(rows) // STRETCHES)))
        self._prior = len(problem.known.places)

    @cached_property
    def owners(self) -> list[int]:
        """Candidate of every variant."""
        return [column.candidate for column in self.rows.layout]

    def columns_of(self, variants: Sequence[int]) -> Array:
        """Raw columns (n, ...) of some variants."""
        places = [self.rows.columns[:, self.rows.layout[variant].place] for variant in variants]
        return np.hstack([np.zeros((len(self.rows), 0)), *places])

    def fitted_columns_of(self, variants: Sequence[int]) -> Array:
        """Of those the ones that have coefficients (n, k): not what was found in the rows themselves."""
        return self.columns_of([variant for variant in variants if not self.was_found(variant)])

    def found_of(self, variants: Sequence[int]) -> Array:
        """What was found in the rows themselves (n,), of some variants: its coefficient is one."""
        found = self.columns_of([variant for variant in variants if self.was_found(variant)])
        return np.asarray(found.sum(axis=1))

    def was_found(self, variant: int) -> bool:
        """Whether the columns of a variant are taken from the rows themselves."""
        return self.problem.candidates[self.owners[variant]].as_found

    @property
    def strongest(self) -> tuple[int, ...]:
        """The best variants of all candidates, whether or not they are there.

        Were the colour that of the whole residual, an effect of long memory would be taken for noise of long memory
        and whitened away. What the best candidates can explain is therefore taken off first.
        """
        plain, flat = (self._directions(self.colour_beside(self.columns_of(()), order)) for order in (ORDER, 0))
        best = self._best(plain, CONTENDING)
        large = self._best(flat, LARGE * float(flat.residual @ flat.residual))
        most = min(CONTENDERS, len(self.rows) // ROWS_PER_CONTENDER)
        return _one_each([*large[:most], *best[:most]], self.owners)

    def _directions(self, whitener: Whitener) -> Directions:
        return directions(self.white(whitener, ()), self.rows.layout)

    def colour_beside(self, columns: Array, order: int = ORDER) -> Whitener:
        """Colour of what the baseline and columns (n, k) leave, fitted by turns with them; of order 0 only levels."""
        left = self.left_beside(columns, order)
        return fit_whitener(self.rows, left.residual, left.fitted, order, self.repeats)

    def left_beside(self, columns: Array, order: int = ORDER) -> Left:
        """What the baseline and columns (n, k) leave, fitted once more by the colour of what they leave."""
        design = np.hstack([self.rows.baseline, columns])
        residual = self.rows.target - design @ self._level(design)
        whitener = fit_whitener(self.rows, residual, design.shape[1], order, self.repeats)
        white = whitener.apply(self.rows, np.column_stack([design, self.rows.target]))
        residual = self.rows.target - design @ least_squares(white[:, :-1], white[:, -1])
        return Left(residual, design.shape[1])

    def _level(self, design: Array) -> Array:
        """Coefficients of some columns (n, k), every group in units of what the baseline leaves of it."""
        weighted = np.column_stack([design, self.rows.target]) / self._scale[:, None]
        return least_squares(weighted[:, :-1], weighted[:, -1])

    @cached_property
    def repeats(self) -> Sequence[Colour]:
        """Colour of what differs between repeats, of measurement and motion: without model, and what is irregular."""
        return self.repeats_without([None] * len(self.rows.blocks))

    def repeats_without(self, series: Series) -> Sequence[Colour]:
        """The same without what differs between the repeats of some series (N,), one a block."""
        parameters = self._level(self.rows.baseline)
        residuals = [block.regular - block.baseline @ parameters for block, _ in self.rows.blocks]
        left = [one if known is None else one - known for one, known in zip(residuals, series, strict=True)]
        return colours_of_repeats(self.rows, left)

    @cached_property
    def _scale(self) -> Array:
        """Rms (n,) of what the baseline alone leaves of the group of a row: groups have different units."""
        scale = np.ones(len(self.rows))
        for group in np.unique(self.rows.group):
            place = self.rows.group == group
            scale[place] = unit_of(self.rows.baseline[place], self.rows.target[place])
        return scale

    def _best(self, found: Directions, least: float) -> list[int]:
        """The best variant of every candidate, by likelihood ratio, if that exceeds `least`."""
        ratios = found.ratios(found.basis.T @ found.residual)
        best: dict[int, int] = {}
        for variant in np.argsort(ratios)[::-1].tolist():
            if ratios[variant] > least:
                best.setdefault(self.owners[variant], variant)
        return list(best.values())

    def white(self, whitener: Whitening, given: Sequence[int], columns: Array | None = None) -> White:
        """Whitened rows, variants that are given beside the baseline; columns (n, K) of all candidates, or others."""
        rows = self.rows
        taken = self.columns_of(given)
        values = np.column_stack([rows.target, rows.baseline, taken, rows.columns if columns is None else columns])
        white = whitener.apply(rows, values)
        confirming = rows.confirming
        if self._prior:
            white = np.vstack([white, self._prior_rows(values.shape[1])])
            confirming = np.append(confirming, np.zeros(self._prior, dtype=bool))
        split = 1 + rows.baseline.shape[1] + taken.shape[1]
        return White(white[:, 0], white[:, 1:split], white[:, split:], confirming)

    def prior_residual(self, baseline: Array) -> Array:
        """What is known beforehand of parameters (p,), minus these, in independent standard deviations (k,)."""
        known = self.problem.known
        return np.asarray(known.precision @ (known.values - baseline[known.places]))

    def prior_jacobian(self, width: int) -> Array:
        """Derivative of what `prior_residual` is compared with, by `width` values, the parameters in front."""
        known = self.problem.known
        return np.asarray(known.precision @ np.eye(width)[known.places])

    def _prior_rows(self, width: int) -> Array:
        parameters = self.rows.baseline.shape[1]
        target = self.prior_residual(np.zeros(parameters))
        return np.column_stack([target, self.prior_jacobian(width - 1)])


def _one_each(variants: Sequence[int], owners: Sequence[int]) -> tuple[int, ...]:
    """The first variant of every candidate."""
    first: dict[int, int] = {}
    for variant in variants:
        first.setdefault(owners[variant], variant)
    return tuple(first.values())


def _stretches(rows: Rows, length: int) -> NDArray[np.int64]:
    """Number (n,) of the stretch of a run that every row belongs to."""
    number, first = np.zeros(len(rows), dtype=np.int64), 0
    for run in np.split(np.arange(len(rows)), np.flatnonzero(np.diff(rows.run) != 0) + 1):
        if run.size:
            count = max(1, round(run.size / length))
            number[run] = first + np.arange(run.size) * count // run.size
            first += count
    return number

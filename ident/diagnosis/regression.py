"""The rows as one whitened regression, and what may stand in each place of an explanation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.directions import Directions, White, directions
from ident.diagnosis.evidence import Evidence, gather
from ident.diagnosis.linear import least_squares, unit_of
from ident.diagnosis.problem import Problem, Series
from ident.diagnosis.rows import Rows
from ident.diagnosis.settings import Settings
from ident.diagnosis.whitening import ORDER, Colour, Left, Whitener, Whitening, colours_of_repeats, fit_whitener

Array = NDArray[np.float64]

Mask = NDArray[np.bool_]

LARGE: Final = 0.1
"""Part of the sum of squares, colour apart, from which a candidate is taken off too: whitening can hide it."""

ROWS_PER_CONTENDER: Final = 40

CONTENDING: Final = 12.0
"""Likelihood ratio from which a candidate is taken off: what chance alone seldom reaches is not taken for noise."""

CONTENDERS: Final = 12
"""Candidates that are taken off before the colour of the noise is found."""

SAME: Final = 0.9999
"""Cosine of two columns that are one and the same."""

SIMPLER: Final = 3.0
"""Log evidence that a further column of the same candidate must bring."""


@dataclass(frozen=True)
class Slot:
    """What may stand in one place of the explanation, the others given.

    Attributes:
        evidence: of every variant.
        variants: the best one of every candidate, best first.
        events: candidates, best first, whose evidence is clear and all of one drive: no cause.
        seen: variants (V,) that the fitted rows show and the confirming ones confirm.
    """

    evidence: Evidence
    variants: tuple[int, ...]
    events: tuple[int, ...]
    seen: Mask

    @property
    def log_evidence(self) -> Array:
        """Of the variants, against nothing in this place."""
        return self.evidence.log_evidence[list(self.variants)]


Whole = tuple[int, frozenset[int]]
"""A variant that is several candidates at once, and the numbers of those."""


class Regression:
    """Rows of the problems, whitened as the effects taken so far let them be, and the evidence for every candidate."""

    def __init__(self, problem: Problem, rows: Rows, settings: Settings, seed: int) -> None:
        """`seed` draws the signs of the surrogates."""
        self.problem = problem
        self.rows = rows
        self.settings = settings
        self.seed = seed
        length = max(1, min(settings.stretch, len(rows) // settings.stretches))
        self.stretch = _stretches(rows, length)
        self._prior = len(problem.known.places)
        count = int(np.unique(self.stretch).size) + self._prior
        self.signs = np.random.default_rng(seed).choice([-1.0, 1.0], size=(settings.surrogates, count))

    @cached_property
    def owners(self) -> list[int]:
        """Candidate of every variant."""
        return [column.candidate for column in self.rows.layout]

    @cached_property
    def _learnt(self) -> Mask:
        """Variants (V,) whose shape the fitted rows have taught and the confirming ones confirmed, as sure as it is."""
        return np.array([self.problem.candidates[owner].learnt for owner in self.owners], dtype=bool)

    @cached_property
    def broad(self) -> list[Whole]:
        """Effects with what comes along with them, where that is a candidate of its own."""
        candidates = self.problem.candidates
        numbers = {candidate.key: number for number, candidate in enumerate(candidates)}
        found = []
        for number, candidate in enumerate(candidates):
            along = numbers.get(f"{candidate.along}@{candidate.where}")
            if along is not None:
                mine = [variant for variant, owner in enumerate(self.owners) if owner == number]
                widest = max(mine, key=lambda variant: self.rows.layout[variant].width)
                found.append((widest, frozenset({number, along})))
        return found

    @cached_property
    def wholes(self) -> list[Whole]:
        """Variants of several columns each of which is another candidate by itself."""
        norms = np.linalg.norm(self.rows.columns, axis=0)
        unit = self.rows.columns / np.where(norms > 0, norms, 1.0)
        layout = self.rows.layout
        alone = {column.place.start: column.candidate for column in layout if column.width == 1}
        singles = unit[:, list(alone)]
        found = []
        for variant, column in enumerate(layout):
            if column.width < 2:
                continue
            cosines = np.abs(unit[:, column.place].T @ singles)
            if np.all(cosines.max(axis=1, initial=0.0) > SAME):
                several = frozenset(list(alone.values())[best] for best in cosines.argmax(axis=1).tolist())
                found += [(variant, several)] if column.candidate not in several else []
        return found

    def key(self, variant: int) -> str:
        """Key of a variant's candidate."""
        return self.problem.candidates[self.owners[variant]].key

    def columns_of(self, variants: Sequence[int]) -> Array:
        """Raw columns (n, ...) of some variants."""
        places = [self.rows.columns[:, self.rows.layout[variant].place] for variant in variants]
        return np.hstack([np.zeros((len(self.rows), 0)), *places])

    def whitener(self, variants: Sequence[int]) -> Whitener:
        """Colour of the noise: of what these variants and, on top, the best of the others cannot explain.

        Were the colour that of the whole residual, an effect of long memory would be taken for noise of long memory
        and whitened away. What the best candidates can explain is therefore taken off first, believed or not.
        """
        return self._colour(self.with_strongest(variants))

    def with_strongest(self, variants: Sequence[int]) -> tuple[int, ...]:
        """These variants and, on top, the best of the others, believed or not."""
        plain, flat = self._colour(variants), self._colour(variants, order=0)
        best = self._best(directions(self.white(plain, variants), self.rows.layout), variants, CONTENDING)
        level = directions(self.white(flat, variants), self.rows.layout)
        large = self._best(level, variants, LARGE * float(level.residual @ level.residual))
        most = min(CONTENDERS, len(self.rows) // ROWS_PER_CONTENDER)
        return (*variants, *_one_each([*large[:most], *best[:most]], self.owners))

    def _colour(self, variants: Sequence[int], order: int = ORDER) -> Whitener:
        return self.colour_beside(self.columns_of(variants), order)

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

    def log_likelihood(self, columns: Array, whitener: Whitener) -> float:
        """Largest log likelihood of all rows with the baseline and columns (n, k), but for a constant of all noises."""
        white = whitener.apply(self.rows, np.column_stack([self.rows.baseline, columns, self.rows.target]))
        left = white[:, -1] - white[:, :-1] @ least_squares(white[:, :-1], white[:, -1])
        return whitener.log_volume(self.rows) - 0.5 * float(left @ left)

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

    def _best(self, found: Directions, given: Sequence[int], least: float) -> list[int]:
        """The best variant of every candidate that is not given, by likelihood ratio, if that exceeds `least`."""
        ratios = found.ratios(found.basis.T @ found.residual)
        taken = {self.owners[variant] for variant in given}
        best: dict[int, int] = {}
        for variant in np.argsort(ratios)[::-1].tolist():
            if self.owners[variant] not in taken and ratios[variant] > least:
                best.setdefault(self.owners[variant], variant)
        return list(best.values())

    def white(self, whitener: Whitening, given: Sequence[int], columns: Array | None = None) -> White:
        """Whitened rows, variants that are given beside the baseline; columns (n, K) of all candidates, or others."""
        rows = self.rows
        taken = self.columns_of(given)
        values = np.column_stack([rows.target, rows.baseline, taken, rows.columns if columns is None else columns])
        white = whitener.apply(rows, values)
        confirming, stretch = rows.confirming, self.stretch
        if self._prior:
            white = np.vstack([white, self._prior_rows(values.shape[1])])
            confirming = np.append(confirming, np.zeros(self._prior, dtype=bool))
            stretch = np.append(stretch, stretch.max(initial=0) + 1 + np.arange(self._prior))
        split = 1 + rows.baseline.shape[1] + taken.shape[1]
        return White(white[:, 0], white[:, 1:split], white[:, split:], stretch, confirming)

    def evidence(self, whitener: Whitener, given: Sequence[int]) -> Evidence:
        """Evidence for every variant beside those given; candidates of those given do not compete."""
        taken = {self.owners[variant] for variant in given}
        excluded = np.array([owner in taken for owner in self.owners], dtype=bool)
        return gather(self.white(whitener, given), self.rows.layout, self.signs, excluded)

    def slot(self, given: Sequence[int], whitener: Whitener) -> Slot:
        """What may stand beside the variants given."""
        evidence = self.evidence(whitener, given)
        seen = in_both(evidence, self.settings) | self._learnt
        once = ~seen & (evidence.log_evidence > self.settings.clear)
        found = np.where(once, -np.inf, evidence.log_evidence)
        strongest = sorted(np.flatnonzero(once).tolist(), key=lambda variant: -float(evidence.log_evidence[variant]))
        events = tuple(dict.fromkeys(self.owners[variant] for variant in strongest))
        contenders: dict[int, list[int]] = {}
        for variant in np.flatnonzero(np.isfinite(found)).tolist():
            contenders.setdefault(self.owners[variant], []).append(variant)
        best = [self._simplest(variants, found) for variants in contenders.values()]
        return Slot(evidence, tuple(sorted(best, key=lambda variant: -float(found[variant]))), events, seen)

    def invisible(self) -> tuple[str, ...]:
        """Names of effects of which no place and no variant leaves anything beside the baseline."""
        sizes = self.evidence(self.whitener(()), ()).directions.sizes
        candidates = self.problem.candidates
        visible = {candidates[owner].effect for owner, size in zip(self.owners, sizes, strict=True) if size}
        names = dict.fromkeys(candidate.effect for candidate in candidates)
        return tuple(str(name) for name in names if name not in visible)

    def _simplest(self, variants: Sequence[int], log_evidence: Array) -> int:
        """The best variant of a candidate, or one of fewer columns that is nearly as good."""
        best: int = max(variants, key=lambda variant: float(log_evidence[variant]))
        width = {variant: self.rows.layout[variant].width for variant in variants}
        close = [variant for variant in variants if log_evidence[variant] > log_evidence[best] - SIMPLER]
        narrow = [variant for variant in close if width[variant] < width[best]]
        return max(narrow or [best], key=lambda variant: float(log_evidence[variant]))

    def prior_residual(self, baseline: Array) -> Array:
        """What is known beforehand of parameters (p,), minus these, in standard deviations (k,)."""
        known = self.problem.known
        return (known.values - baseline[known.places]) / known.std

    def prior_jacobian(self, width: int) -> Array:
        """Derivative of what `prior_residual` is compared with, by `width` values, the parameters in front."""
        known = self.problem.known
        return np.eye(width)[known.places] / known.std[:, None]

    def _prior_rows(self, width: int) -> Array:
        parameters = self.rows.baseline.shape[1]
        target = self.prior_residual(np.zeros(parameters))
        return np.column_stack([target, self.prior_jacobian(width - 1)])


def in_both(evidence: Evidence, settings: Settings) -> Mask:
    """Variants (V,) that the fitted rows show and the confirming ones confirm."""
    whole = evidence.directions.ratios(evidence.amplitudes) / evidence.scale
    fitted, confirming = 1 - evidence.confirming, evidence.confirming
    shown = _enough(fitted, whole, settings)
    confirmed = (evidence.log_predictive >= settings.confirmation) & _enough(confirming, whole, settings)
    return np.asarray(shown & confirmed)


def _enough(share: Array, whole: Array, settings: Settings) -> Mask:
    """Whether some rows have their share of what a variant does, or a likelihood ratio of it that speaks for itself."""
    return np.asarray((share > settings.part) | (share * whole > settings.plain))


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

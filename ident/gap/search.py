"""The search for causes: one at a time, in pairs where none helps alone, each confirmed before it counts.

The order of the steps is what keeps false alarms down (see docs/gap.md): whiten, compare with surrogates over all
candidates at once, confirm on rows that took no part in the fit, then look at every effect found again, the others
given.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ident.gap.evidence import Evidence, White, best_pair, gather
from ident.gap.problem import Problem
from ident.gap.rows import Rows
from ident.gap.whitening import Whitener, fit_whitener

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Settings:
    """Thresholds of the search.

    Attributes:
        level: largest probability by chance, over all candidates at once, at which an effect is believed.
        confirmation: smallest log Bayes factor of the confirming rows.
        stretch: length of the stretches whose sign a surrogate flips [s].
        surrogates: how many.
        most: effects named at most.
        lead: log evidence by which another candidate must beat one already taken to replace it.
    """

    level: float = 0.05
    confirmation: float = 0.5
    stretch: float = 1.0
    surrogates: int = 600
    most: int = 4
    lead: float = 0.5


class Regression:
    """Rows of the problems, whitened as the effects taken so far let them be, and the evidence for every candidate."""

    def __init__(self, problem: Problem, rows: Rows, settings: Settings, seed: int) -> None:
        """`seed` draws the signs of the surrogates."""
        self.problem = problem
        self.rows = rows
        self.settings = settings
        self.stretch = _stretches(rows, settings.stretch)
        nominal = problem.nominal
        self._prior = 0 if nominal is None else len(nominal.values)
        count = int(np.unique(self.stretch).size) + self._prior
        self.signs = np.random.default_rng(seed).choice([-1.0, 1.0], size=(settings.surrogates, count))

    @cached_property
    def owners(self) -> list[int]:
        """Candidate of every variant."""
        return [column.candidate for column in self.rows.layout]

    def columns_of(self, variants: Sequence[int]) -> Array:
        """Raw columns (n, ...) of some variants."""
        places = [self.rows.columns[:, self.rows.layout[variant].place] for variant in variants]
        return np.hstack([np.zeros((len(self.rows), 0)), *places])

    def whitener(self, variants: Sequence[int]) -> Whitener:
        """Colour of what the baseline and these variants leave, twice so that the second fit is a weighted one."""
        design = np.hstack([self.rows.baseline, self.columns_of(variants)])
        residual = self.rows.target - design @ _least_squares(design, self.rows.target)
        for _ in range(2):
            whitener = fit_whitener(self.rows, residual, design.shape[1])
            white = whitener.apply(self.rows, np.column_stack([design, self.rows.target]))
            residual = self.rows.target - design @ _least_squares(white[:, :-1], white[:, -1])
        return whitener

    def white(self, whitener: Whitener, given: Sequence[int]) -> White:
        """Whitened rows, variants that are given beside the baseline."""
        rows = self.rows
        taken = self.columns_of(given)
        values = np.column_stack([rows.target, rows.baseline, taken, rows.columns])
        white = whitener.apply(rows, values)
        confirming, stretch = rows.confirming, self.stretch
        if self._prior:
            white = np.vstack([white, self._prior_rows(values.shape[1])])
            confirming = np.append(confirming, np.zeros(self._prior, dtype=bool))
            stretch = np.append(stretch, stretch.max(initial=0) + 1 + np.arange(self._prior))
        split = 1 + rows.baseline.shape[1] + taken.shape[1]
        return White(white[:, 0], white[:, 1:split], white[:, split:], stretch, confirming)

    def evidence(self, whitener: Whitener, given: Sequence[int], selected: Sequence[int]) -> Evidence:
        """Evidence for every variant beside those given; candidates of those given do not compete."""
        white = self.white(whitener, given)
        residual = None
        if selected != given:
            whole = np.hstack([white.baseline, white.columns[:, self._places(selected)]])
            residual = white.target - whole @ _least_squares(whole, white.target)
        taken = {self.owners[variant] for variant in given}
        excluded = np.array([owner in taken for owner in self.owners], dtype=bool)
        return gather(white, self.rows.layout, self.signs, residual, excluded)

    def _places(self, variants: Sequence[int]) -> NDArray[np.int64]:
        places = [np.arange(column.place.start, column.place.stop) for column in self.rows.layout]
        return np.concatenate([np.zeros(0, dtype=np.int64), *(places[variant] for variant in variants)])

    def _prior_rows(self, width: int) -> Array:
        nominal = self.problem.nominal
        assert nominal is not None
        prior = np.zeros((self._prior, width))
        prior[:, 0] = nominal.values / nominal.std
        prior[:, 1 : 1 + self._prior] = np.diag(1 / nominal.std)
        return prior


@dataclass(frozen=True)
class Found:
    """What the search ends with.

    Attributes:
        variants: taken, in the order of the search.
        whitener: of what they leave.
        slots: evidence for every candidate in the place of each one taken, the others given.
        rest: evidence for one more.
    """

    variants: tuple[int, ...]
    whitener: Whitener
    slots: tuple[Evidence, ...]
    rest: Evidence


def search(regression: Regression) -> Found:
    """Forward in singles and pairs, then every effect in doubt again."""
    taken: tuple[int, ...] = ()
    while len(taken) < regression.settings.most:
        grown = _grown(regression, taken)
        if grown == taken:
            break
        settled = _settled(regression, grown)
        if set(settled) <= set(taken):
            break
        taken = settled
    whitener = regression.whitener(taken)
    slots = tuple(regression.evidence(whitener, _without(taken, index), taken) for index in range(len(taken)))
    return Found(taken, whitener, slots, regression.evidence(whitener, taken, taken))


def _grown(regression: Regression, taken: tuple[int, ...]) -> tuple[int, ...]:
    settings = regression.settings
    evidence = regression.evidence(regression.whitener(taken), taken, taken)
    if not np.isfinite(evidence.log_evidence).any():
        return taken
    best = int(np.argmax(evidence.log_evidence))
    if evidence.significance <= settings.level and evidence.log_predictive[best] >= settings.confirmation:
        return (*taken, best)
    if len(taken) + 2 > settings.most:
        return taken
    pair = best_pair(evidence, regression.owners, len(regression.rows))
    if pair is None or pair.significance > settings.level or pair.log_evidence < evidence.log_evidence[best]:
        return taken
    return (*taken, pair.first, pair.second)


def _settled(regression: Regression, taken: tuple[int, ...]) -> tuple[int, ...]:
    """Replace what another candidate explains better, drop what the others make superfluous, until nothing changes."""
    for _ in range(2 * len(taken)):
        changed = _revised(regression, taken)
        if changed == taken:
            break
        taken = changed
    return taken


def _revised(regression: Regression, taken: tuple[int, ...]) -> tuple[int, ...]:
    settings = regression.settings
    whitener = regression.whitener(taken)
    for index, variant in enumerate(taken):
        evidence = regression.evidence(whitener, _without(taken, index), taken)
        best = int(np.argmax(evidence.log_evidence))
        if evidence.log_evidence[best] > evidence.log_evidence[variant] + settings.lead:
            return (*taken[:index], best, *taken[index + 1 :])
        if evidence.significance > settings.level or evidence.log_predictive[variant] < settings.confirmation:
            return _without(taken, index)
    return taken


def _without(taken: tuple[int, ...], index: int) -> tuple[int, ...]:
    return (*taken[:index], *taken[index + 1 :])


def _stretches(rows: Rows, duration: float) -> NDArray[np.int64]:
    """Number (n,) of the stretch of a run that every row belongs to."""
    number, first = np.zeros(len(rows), dtype=np.int64), 0
    for run in np.split(np.arange(len(rows)), np.flatnonzero(np.diff(rows.run) != 0) + 1):
        if run.size:
            length = max(1, round(duration * rows.rate[run[0]]))
            count = max(1, round(run.size / length))
            number[run] = first + np.arange(run.size) * count // run.size
            first += count
    return number


def _least_squares(design: Array, target: Array) -> Array:
    scale = np.linalg.norm(design, axis=0)
    scale[scale == 0] = 1.0
    return np.asarray(np.linalg.lstsq(design / scale, target, rcond=1e-7)[0] / scale)

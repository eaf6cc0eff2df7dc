"""Hypotheses that are not linear in their size, about the numbers that were found: columns stand near zero.

With coefficients a of its columns, an effect of the numbers that a and h stand for adds f(a, h): h are those that every
column is made for, the rate at which a friction falls off, the order of a ripple. About some a₀ that is f(a₀) - J a₀,
which is taken off the target, and J a: the slope J takes the place of the columns (Gauss and Newton). h is moved to
where the rows want it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.hypotheses.hypotheses import Block, Hypothesis
from ident.diagnosis.noise.colours import Colours
from ident.diagnosis.observations.rows import Rows
from ident.diagnosis.problem import Candidate, Problem, Series, contributions_of, forces_of, turned_by

Array = NDArray[np.float64]

NEGLIGIBLE: Final = 0.1
"""Sum of squares, in units of the noise, that columns may miss."""

STEP: Final = 1e-4
"""Of a coefficient, for a slope."""

NEAR: Final = 0.1
"""Change of the coefficients, over the largest of them, of the plant's parameters, or of the forces of others, for
which slopes are held."""

NEAR_PLANT: Final = 1e-3
"""Change of the plant's parameters, or of the forces of others, relative, for which an exact form is held."""

SAME: Final = 0.1
"""Of coefficients, in standard deviations by the usual noise, that change nothing."""

KEPT: Final = 16
"""Answers of every hypothesis, the last ones: a search comes back to numbers that it was at before."""


@dataclass(frozen=True)
class Bent:
    """A hypothesis about some numbers.

    Attributes:
        place: of its columns among all.
        about: (K,) the coefficients.
        held: (H,) the numbers that columns are made for.
        numbers: (m,) all numbers of its exact form.
        slopes: (n, K) that take the place of the columns.
        missed: (n,) what these miss of it.
        expected: (m, K) and (m,) rows beside those of the records, in standard deviations: what physics expects of
            numbers that come along with it.
        beside: (p,) parameters of the plant.
        others: (n,) forces of others, that it turns.
        sloped: coefficients (K,), parameters (p,) and forces of others (n,), that the slopes were computed for.
    """

    place: slice
    about: Array
    held: Array
    numbers: Array
    slopes: Array
    missed: Array
    expected: tuple[Array, Array]
    beside: Array
    others: Array
    sloped: tuple[Array, Array, Array]

    def is_of(self, coefficients: Array, parameters: Array, others: Array) -> bool:
        """Whether it is about these, but for what changes nothing."""
        moved = float(np.abs(self.about - coefficients).max())
        near = moved < SAME / math.sqrt(len(self.missed)) and _is_near(self.others, others, NEAR_PLANT)
        return near and bool(np.allclose(self.beside, parameters, rtol=NEAR_PLANT, atol=0.0))

    def has_slopes_near(self, coefficients: Array, parameters: Array, others: Array) -> bool:
        """Whether its slopes were computed for nearly these."""
        about, beside, turned = self.sloped
        near = np.abs(about - coefficients).max() < NEAR * np.abs(coefficients).max() and _is_near(turned, others, NEAR)
        return bool(near and np.allclose(beside, parameters, rtol=NEAR, atol=0.0))


class Bends:
    """Exact forms of all candidates.

    Args:
        problems: to fit and to confirm.
        colours: of the noise of their rows.
    """

    def __init__(self, problems: Sequence[Problem], colours: Colours) -> None:
        self.problems, self.colours = problems, colours
        self._straight: dict[tuple[str, int], float] = {}
        self._kept: dict[tuple[str, int], list[Bent]] = {}

    def is_bent(self, hypothesis: Hypothesis, block: Block) -> bool:
        """Whether there is more to a hypothesis than its columns."""
        if hypothesis.candidate is None or block.column is None:
            return False
        candidate = self.problems[0].candidates[hypothesis.candidate]
        return candidate.contribution is not None and candidate.variants[block.column.variant].bent

    def turns(self, hypothesis: Hypothesis) -> bool:
        """Whether it makes something of the forces of others."""
        candidates = self.problems[0].candidates
        return hypothesis.candidate is not None and candidates[hypothesis.candidate].turned is not None

    def form(self, hypothesis: Hypothesis, block: Block, parameters: Array, others: Series = ()) -> Form:
        """A name, beside some parameters (p,) of the plant, and forces of others that it turns."""
        assert hypothesis.candidate is not None
        candidates = [problem.candidates[hypothesis.candidate] for problem in self.problems]
        return Form(hypothesis.key, candidates, block, self.colours.rows, parameters, others)

    def last(self, hypothesis: Hypothesis, block: Block) -> Bent | None:
        """About the numbers that were asked for last, whatever stood beside.

        Where no numbers are held, which might have been moved to where another set wants them.
        """
        kept = self._kept.get((hypothesis.key, block.place.start))
        return kept[0] if kept and not kept[0].held.size else None

    def bend(self, form: Form, coefficients: Array, held: Array | None) -> Bent | None:
        """About some coefficients (K,) and held numbers (H,), or those of the columns; None where these miss nothing.

        An earlier answer, where the coefficients are those but for `SAME`.
        """
        key, size, others = form.key, float(np.abs(coefficients).max()), form.rows_of_others
        if held is None and not others.any() and size <= self._straight.get(key, 0.0):
            return None
        numbers = form.held(coefficients) if held is None else held
        kept = [one for one in self._kept.get(key, []) if np.array_equal(one.held, numbers)]
        for one in kept:
            if one.is_of(coefficients, form.parameters, others):
                return self._put_first(key, one)
        here, expected = form.added(coefficients, numbers), form.expected_about(coefficients, numbers)
        if held is None and not len(expected[1]) and self._power(here - form.by_columns(coefficients)) < NEGLIGIBLE:
            if not others.any():
                self._straight[key] = size
            return None
        near = next((one for one in kept if one.has_slopes_near(coefficients, form.parameters, others)), None)
        if near is None:
            slopes, sloped = form.slopes(coefficients, numbers, here), (coefficients, form.parameters, others)
        else:
            slopes, sloped = near.slopes, near.sloped
        found = Bent(
            place=form.block.place,
            about=coefficients,
            held=numbers,
            numbers=form.numbers(coefficients, numbers),
            slopes=slopes,
            missed=here - slopes @ coefficients,
            expected=expected,
            beside=form.parameters,
            others=others,
            sloped=sloped,
        )
        return self._put_first(key, found)

    def _put_first(self, key: tuple[str, int], bent: Bent) -> Bent:
        """The same, as the one that was asked for last."""
        self._kept[key] = [bent, *(one for one in self._kept.get(key, []) if one is not bent)][:KEPT]
        return bent

    def _power(self, series: Array) -> float:
        """Sum of squares of a series (n,), in units of the noise."""
        return float(np.sum(self.colours.white(series[:, None], self.colours.usual)[0] ** 2))


@dataclass(frozen=True)
class Form:
    """One hypothesis as it is.

    Attributes:
        name: its key.
        candidates: it in the problems to fit and to confirm.
        block: its columns.
        rows: of the problems.
        parameters: (p,) of the plant beside it.
        others: their forces, that it turns; empty where there are none.
    """

    name: str
    candidates: Sequence[Candidate]
    block: Block
    rows: Rows
    parameters: Array
    others: Series = ()

    @property
    def key(self) -> tuple[str, int]:
        """Unique among all blocks."""
        return self.name, self.block.place.start

    def by_columns(self, coefficients: Array) -> Array:
        """(n,) what its columns add."""
        assert self.block.column is not None
        return np.asarray(self.rows.columns[:, self.block.column.place] @ self._raw(coefficients))

    @cached_property
    def rows_of_others(self) -> Array:
        """(n,) forces of others, unfiltered."""
        return self.rows.stack(self.others) if self.others else np.zeros(len(self.rows))

    def added(self, coefficients: Array, held: Array) -> Array:
        """(n,) what it adds, and makes of the forces of others."""
        numbers = self.numbers(coefficients, held)
        found = self.rows.stack(contributions_of(self.candidates, numbers, self.parameters))
        return found + self.rows.stack(turned_by(self.candidates, numbers, self.others)) if self.others else found

    @property
    def has_force(self) -> bool:
        """Whether others may turn it."""
        return self.candidates[0].force is not None

    def force(self, coefficients: Array, held: Array) -> Series:
        """Of its own, unfiltered."""
        return forces_of(self.candidates, self.numbers(coefficients, held), self.parameters)

    def slopes(self, coefficients: Array, held: Array, here: Array) -> Array:
        """(n, K) over the coefficients, `here` being what it adds."""
        steps = STEP * np.maximum(np.abs(coefficients), 1.0)
        return _slopes(lambda values: self.added(values, held), coefficients, here, steps)

    def held_slopes(self, bent: Bent) -> tuple[Array, Array]:
        """(n, H) over the held numbers, and (m, H) of the rows of what is expected."""

        def both(held: Array) -> Array:
            return np.concatenate([self.added(bent.about, held), self._expected(bent.about, held)])

        here = np.concatenate([bent.missed + bent.slopes @ bent.about, self._expected(bent.about, bent.held)])
        found = _slopes(both, bent.held, here, STEP * np.maximum(np.abs(bent.held), STEP))
        return found[: len(bent.missed)], found[len(bent.missed) :]

    def expected_about(self, coefficients: Array, held: Array) -> tuple[Array, Array]:
        """Rows of what is expected of its numbers, over the coefficients."""
        here = self._expected(coefficients, held)
        steps = STEP * np.maximum(np.abs(coefficients), 1.0)
        slopes = _slopes(lambda values: self._expected(values, held), coefficients, here, steps)
        return slopes, slopes @ coefficients - here

    def held(self, coefficients: Array) -> Array:
        """(H,) numbers that the coefficients say nothing of, as the columns are made for."""
        return self._started(coefficients)[self._is_held]

    @cached_property
    def _is_held(self) -> NDArray[np.bool_]:
        """(M,) which numbers the coefficients say nothing of; nor those that come along with what does not show."""
        ones = np.ones(len(self.block.sizes))
        here, parts = self._started(ones), range(len(ones))
        moved = [self._started(ones + np.eye(len(ones))[part]) != here for part in parts]
        found = ~np.logical_or.reduce(moved)
        if not self.block.kept.all():
            # What comes along with columns that show nothing shows nothing.
            found[len(self.candidates[0].parameters) :] = False
        return np.asarray(found)

    def numbers(self, coefficients: Array, held: Array) -> Array:
        """(m,) of the exact form."""
        found = self._started(coefficients)
        if held.size:
            found[self._is_held] = held
        return found

    def _started(self, coefficients: Array) -> Array:
        assert self.block.column is not None
        return self.candidates[0].variants[self.block.column.variant].numbers(self._raw(coefficients))

    def _raw(self, coefficients: Array) -> Array:
        """Coefficients of all columns of the variant, as the rows have them."""
        assert self.block.column is not None
        found = np.zeros(self.block.column.width)
        found[self.block.kept] = coefficients / self.block.sizes
        return found

    def _expected(self, coefficients: Array, held: Array) -> Array:
        expected = self.candidates[0].expected
        return np.zeros(0) if expected is None else expected(self.numbers(coefficients, held))


def _is_near(one: Array, other: Array, share: float) -> bool:
    return bool(np.abs(one - other).max() <= share * np.abs(other).max())


def _slopes(function: Callable[[Array], Array], about: Array, here: Array, steps: Array) -> Array:
    """(n, k) by differences; where a number is at the end of what it may be, towards the inside."""
    found = np.empty((len(here), len(about)))
    for place, step in enumerate(steps.tolist()):
        for towards in (step, -step):
            there = about.copy()
            there[place] += towards
            found[:, place] = (function(there) - here) / towards
            if found[:, place].any():
                break
    return found

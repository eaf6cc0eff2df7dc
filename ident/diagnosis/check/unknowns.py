"""The numbers of one effect in a refit: coefficients of its columns, or those of its exact form."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.observations.rows import Column
from ident.diagnosis.problem import Candidate, Problem, Series, Turned, contributions_of, forces_of, turned_by

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Unknown:
    """What is fitted of one effect.

    Attributes:
        candidates: of every problem.
        place: among all values that are fitted.
        exact: values of its own and of the baseline -> what it adds to every block; None: its columns.
        columns: of every block.
        finish: its values -> its numbers (m,), the parameters of the candidate before those that came along.
        turned: its values, and the forces of others -> what it makes of those.
    """

    candidates: Sequence[Candidate]
    place: slice
    exact: Callable[[Array, Array], Series] | None
    columns: tuple[Array | None, ...]
    finish: Callable[[Array], Array]
    turned: Turned | None = None

    def series(self, values: Array, baseline: Array) -> Series:
        """What it adds to every block, (N,)."""
        if self.exact is not None:
            return self.exact(values, baseline)
        return [None if column is None else column @ values for column in self.columns]

    @property
    def candidate(self) -> Candidate:
        """In the first problem."""
        return self.candidates[0]

    @property
    def is_settled(self) -> bool:
        """Whether nothing of it is fitted."""
        return bool(self.place.start == self.place.stop)

    @property
    def has_force(self) -> bool:
        """Whether others may turn it."""
        return self.turned is None and self.candidate.force is not None

    def forces(self, values: Array, baseline: Array) -> Series:
        """Of every block, unfiltered."""
        return forces_of(self.candidates, self.finish(values), baseline)

    def expected(self, values: Array) -> Array:
        """How far its numbers are from what is expected of them, in standard deviations (k,), from all values."""
        expected = self.candidate.expected
        if self.exact is None or expected is None:
            return np.zeros(0)
        return expected(self.finish(values[self.place]))


def unknown_of(
    problems: Sequence[Problem], column: Column, coefficients: Array, first: int, by_form: bool
) -> tuple[Unknown, Array, Array]:
    """The numbers of a variant, and what they begin with: by coefficients of its columns, and as they were found."""
    candidates = [problem.candidates[column.candidate] for problem in problems]
    variant = candidates[0].variants[column.variant]
    finish = variant.start or _same
    columns = tuple(part for candidate in candidates for part in candidate.variants[column.variant].columns)
    if candidates[0].as_found:
        return _found(candidates, columns, first, finish(np.ones(column.width))), coefficients, coefficients
    if candidates[0].contribution is None or not by_form or not variant.bent:
        place = slice(first, first + len(coefficients))
        return Unknown(candidates, place, None, columns, finish), coefficients, coefficients

    start = np.asarray(finish(coefficients), dtype=float)
    proper = partial(_proper, _above_zero(candidates[0], len(start)))
    turned = None if candidates[0].turned is None else partial(turned_by, candidates)

    def exact(values: Array, baseline: Array) -> Series:
        return contributions_of(candidates, proper(values), baseline)

    unknown = Unknown(candidates, slice(first, first + len(start)), exact, columns, proper, turned)
    return unknown, start, start if variant.found is None else variant.found


def _found(candidates: Sequence[Candidate], columns: tuple[Array | None, ...], first: int, numbers: Array) -> Unknown:
    """What was found in the rows is taken whole: nothing of it is fitted, wherever it is."""
    whole = [None if column is None else column.sum(axis=1) for column in columns]
    return Unknown(candidates, slice(first, first), lambda _values, _baseline: whole, columns, lambda _values: numbers)


def _above_zero(candidate: Candidate, count: int) -> Mask:
    """Which of all numbers (m,) are above zero by what they are: a speed at which friction falls off."""
    stated = [parameter.positive for parameter in candidate.parameters]
    return np.array(stated + [False] * (count - len(stated)))


def _proper(above_zero: Mask, values: Array) -> Array:
    """Numbers (m,), those above zero by their size: an even law has the same one at either sign."""
    return np.where(above_zero, np.abs(values), values)


def _same(values: Array) -> Array:
    return values

"""Hypotheses that are not linear in their size, about the numbers that were found: columns stand near zero.

With coefficients a of its columns, an effect of the numbers that a stands for adds f(a). About some a₀ that is
f(a₀) - J a₀, which is taken off the target, and J a: the slope J takes the place of the columns (Gauss and Newton).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.posterior.hypotheses import Block, Hypothesis
from ident.diagnosis.posterior.noise import Colours
from ident.diagnosis.problem import Candidate, Problem

Array = NDArray[np.float64]

NEGLIGIBLE: Final = 0.1
"""Sum of squares, in units of the noise, that columns may miss."""

STEP: Final = 1e-4
"""Of a coefficient, for a slope."""

NEAR: Final = 0.1
"""Change of the coefficients, over the largest of them, for which slopes are held."""

SAME: Final = 0.01
"""Of coefficients, in units of the noise of a row, that change nothing."""


@dataclass(frozen=True)
class Bent:
    """A hypothesis about some coefficients.

    Attributes:
        place: of its columns among all.
        about: (K,) the coefficients.
        slopes: (n, K) that take the place of the columns.
        missed: (n,) what these miss of it.
        expected: (m, K) and (m,) rows beside those of the records, in standard deviations: what physics expects of
            numbers that come along with it.
    """

    place: slice
    about: Array
    slopes: Array
    missed: Array
    expected: tuple[Array, Array]


class Bends:
    """Exact forms of all candidates.

    Args:
        problems: to fit and to confirm.
        colours: of the noise of their rows.
    """

    def __init__(self, problems: Sequence[Problem], colours: Colours) -> None:
        self.problems, self.colours, self.rows = problems, colours, colours.rows
        self._straight: dict[tuple[str, int], float] = {}
        self._kept: dict[tuple[str, int], Bent] = {}

    def is_bent(self, hypothesis: Hypothesis, block: Block) -> bool:
        """Whether there is more to a hypothesis than its columns."""
        if hypothesis.candidate is None or block.column is None:
            return False
        candidate = self.problems[0].candidates[hypothesis.candidate]
        return candidate.contribution is not None and candidate.variants[block.column.variant].bent

    def bend(self, hypothesis: Hypothesis, block: Block, coefficients: Array, parameters: Array) -> Bent | None:
        """About some coefficients; None where the columns miss nothing that counts.

        The last answer, where the coefficients are those but for `SAME`.

        Args:
            hypothesis: one that is bent.
            block: of it.
            coefficients: (K,) of its columns, of unit rms.
            parameters: (p,) of the plant beside it.
        """
        key = hypothesis.key, block.place.start
        kept, size = self._kept.get(key), float(np.abs(coefficients).max())
        if size <= self._straight.get(key, 0.0):
            return None
        if kept is not None and np.abs(kept.about - coefficients).max() < SAME:
            return kept
        assert hypothesis.candidate is not None
        candidates = [problem.candidates[hypothesis.candidate] for problem in self.problems]

        def added(values: Array) -> Array:
            numbers, series = self._numbers(candidates[0], block, values), list[Array | None]()
            for candidate in candidates:
                assert candidate.contribution is not None
                series += candidate.contribution(numbers, parameters)
            return self.rows.stack(series)

        here = added(coefficients)
        expected = self._expected(candidates[0], block, coefficients)
        if not len(expected[1]) and self._power(here - self._columns(block) @ _raw(block, coefficients)) < NEGLIGIBLE:
            self._straight[key] = size
            return None
        if kept is not None and np.abs(kept.about - coefficients).max() < NEAR * size:
            slopes = kept.slopes
        else:
            slopes = np.empty((len(here), len(coefficients)))
            for place, step in enumerate(STEP * np.maximum(np.abs(coefficients), 1.0)):
                ahead = coefficients.copy()
                ahead[place] += step
                slopes[:, place] = (added(ahead) - here) / step
        found = Bent(block.place, coefficients, slopes, here - slopes @ coefficients, expected)
        self._kept[key] = found
        return found

    def _columns(self, block: Block) -> Array:
        assert block.column is not None
        return self.rows.columns[:, block.column.place]

    def _power(self, series: Array) -> float:
        """Sum of squares of a series (n,), in units of the noise."""
        return float(np.sum(self.colours.white(series[:, None], self.colours.usual)[0] ** 2))

    def _numbers(self, candidate: Candidate, block: Block, coefficients: Array) -> Array:
        assert block.column is not None
        raw, start = _raw(block, coefficients), candidate.variants[block.column.variant].start
        return raw if start is None else np.asarray(start(raw), dtype=float)

    def _expected(self, candidate: Candidate, block: Block, coefficients: Array) -> tuple[Array, Array]:
        """Rows of what is expected, about some coefficients."""
        expected = candidate.expected
        if expected is None:
            return np.zeros((0, len(coefficients))), np.zeros(0)
        here = expected(self._numbers(candidate, block, coefficients))
        slopes = np.zeros((len(here), len(coefficients)))
        for place, step in enumerate(STEP * np.maximum(np.abs(coefficients), 1.0)):
            ahead = coefficients.copy()
            ahead[place] += step
            slopes[:, place] = (expected(self._numbers(candidate, block, ahead)) - here) / step
        return slopes, slopes @ coefficients - here


def _raw(block: Block, coefficients: Array) -> Array:
    """Coefficients of all columns of a variant, as the rows have them."""
    assert block.column is not None
    found = np.zeros(block.column.width)
    found[block.kept] = coefficients / block.sizes
    return found

"""What the columns of a hypothesis miss of it: most effects are not linear in their size, and columns stand near zero.

With coefficients a of columns X, an effect of the numbers that a stands for adds f(a). Its bend f(a) - X a is taken off
the target, and a is found anew, until both agree: Newton's method with the slope held.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.posterior.hypotheses import Block, Hypothesis
from ident.diagnosis.problem import Candidate, Problem
from ident.diagnosis.rows import Rows

Array = NDArray[np.float64]

STEP: Final = 1e-6
"""Of a coefficient, for a slope."""

SAME: Final = 0.01
"""Of coefficients, in units of the noise of a row, that change nothing."""


@dataclass(frozen=True)
class Bent:
    """A hypothesis at some coefficients.

    Attributes:
        place: of its columns among all.
        missed: (n,) what those miss of it.
        expected: (m, K) and (m,) rows beside those of the records, in standard deviations: what physics expects of
            numbers that come along with it.
    """

    place: slice
    missed: Array
    expected: tuple[Array, Array]


class Bends:
    """Exact forms of all candidates.

    Args:
        problems: to fit and to confirm.
        rows: of them.
        parameters: (p,) of the plant, as they are known.
    """

    def __init__(self, problems: Sequence[Problem], rows: Rows, parameters: Array) -> None:
        self.problems, self.rows, self.parameters = problems, rows, parameters
        self._kept: dict[tuple[str, int], tuple[Array, Bent]] = {}

    def is_bent(self, hypothesis: Hypothesis, block: Block) -> bool:
        """Whether there is more to a hypothesis than its columns."""
        if hypothesis.candidate is None or block.column is None:
            return False
        candidate = self.problems[0].candidates[hypothesis.candidate]
        return candidate.contribution is not None and candidate.variants[block.column.variant].bent

    def bend(self, hypothesis: Hypothesis, block: Block, coefficients: Array) -> Bent:
        """What the columns miss; the last answer, where the coefficients are those but for `SAME`.

        Args:
            hypothesis: one that is bent.
            block: of it.
            coefficients: (K,) of its columns, of unit rms.
        """
        key = hypothesis.key, block.place.start
        if key in self._kept and np.abs(self._kept[key][0] - coefficients).max() < SAME:
            return self._kept[key][1]
        self._kept[key] = coefficients, self._bend(hypothesis, block, coefficients)
        return self._kept[key][1]

    def _bend(self, hypothesis: Hypothesis, block: Block, coefficients: Array) -> Bent:
        assert hypothesis.candidate is not None
        candidates = [problem.candidates[hypothesis.candidate] for problem in self.problems]
        numbers, series = self._numbers(candidates[0], block, coefficients), list[Array | None]()
        for candidate in candidates:
            assert candidate.contribution is not None
            series += candidate.contribution(numbers, self.parameters)
        missed = self.rows.stack(series) - self._columns(block) @ _raw(block, coefficients)
        return Bent(block.place, missed, self._expected(candidates[0], block, coefficients))

    def _columns(self, block: Block) -> Array:
        assert block.column is not None
        return self.rows.columns[:, block.column.place]

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

"""Whether a cause that was refitted has a size of its own."""

from __future__ import annotations

from typing import Final

import numpy as np

from ident.diagnosis.check.refit import Part
from ident.diagnosis.observations.linear import ROUNDING
from ident.diagnosis.problem import Candidate

SURELY: Final = 2.0
"""Standard deviations from which a number is not zero."""

ITS_OWN: Final = 3.0
"""The same, by the scatter of rows, of a size beside what comes along, or of what confirming rows speak against: in
thousands of rows, and of many members, a number is worth that."""


def is_sizeless(candidate: Candidate, part: Part) -> bool:
    """Whether an effect that something comes along with may be of no size itself.

    What comes along is the explanation then, or neither is one. Where it is there, a size has to be its own beside it.
    """
    along, size = slice(len(part.values), None), slice(len(part.values))
    if not part.numbers[along].size:
        return False
    least = SURELY * part.scatter[size]
    if np.any(np.abs(part.numbers[along]) > SURELY * part.scatter[along]):
        least = np.maximum(SURELY * part.std, ITS_OWN * part.scatter[size])
    return bool(np.all(np.abs(part.values - (candidate.least or 0.0)) < least))


def is_foreign(candidate: Candidate, part: Part) -> bool:
    """Whether the refit has made something else of an effect, of parameters that it does not have.

    A speed or a distance that is at the least that rows can bound is where they want less of it.
    """
    lowest = np.array(candidate.lowest)
    return bool(np.any((lowest > 0) & (np.abs(part.values[: len(lowest)]) <= (1 + ROUNDING) * lowest)))


def is_nothing(candidate: Candidate, part: Part) -> bool:
    """Whether the refit has made something else of an effect, or of a size that may be zero.

    Something else has parameters that the effect does not have. Of linear ones any is a size, or else the first.
    Beside what comes along, `is_sizeless` says.
    """
    if is_foreign(candidate, part):
        return True
    sizes = slice(None) if candidate.contribution is None else slice(1)
    alone = len(part.numbers) == len(part.values)
    small = np.abs(part.values[sizes]) < SURELY * part.scatter[: len(part.values)][sizes]
    return alone and bool(np.all(small))

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


def is_foreign(candidate: Candidate, part: Part) -> bool:
    """Whether the refit has made something else of an effect, of parameters that it does not have.

    A speed or a distance that is at the least that rows can bound is where they want less of it.
    """
    lowest = np.array(candidate.lowest)
    return bool(np.any((lowest > 0) & (np.abs(part.values[: len(lowest)]) <= (1 + ROUNDING) * lowest)))


def is_sizeless(candidate: Candidate, part: Part) -> bool:
    """Whether the size of an effect may be zero: of linear ones any number is a size, of others the first.

    What comes along is the explanation then, or neither is one. Where that is there, a size has to be its own.
    """
    along, size = slice(len(part.values), None), slice(None if candidate.contribution is None else 1)
    least = SURELY * part.scatter[: len(part.values)]
    if np.any(np.abs(part.numbers[along]) > SURELY * part.scatter[along]):
        least = np.maximum(SURELY * part.std, ITS_OWN * part.scatter[: len(part.values)])
    return bool(np.all(np.abs(part.values[size]) < least[size]))


def is_alone(part: Part) -> bool:
    """Whether nothing comes along with an effect."""
    return len(part.numbers) == len(part.values)

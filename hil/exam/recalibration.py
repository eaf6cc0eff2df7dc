"""Probabilities calibrated on all sources but one, and what they are worth on that one.

What is kept of an exam is enough: every probability that was stated, and whether it was right. Platt's scaling (1999)
makes another one of it, logit p' = a + b logit p, whose two numbers are fitted to the statements of the other sources.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import optimize
from scipy.special import expit, logit

from hil.exam.statistics import calibration_error, reliability

Array = NDArray[np.float64]
Statement = tuple[float, bool]
"""A probability, and whether what it was stated of is right."""

EDGE: Final = 1e-3
"""Nearer to zero and one no probability is taken to be."""

PRIOR_STD: Final = 1.0
"""Of a and b about 0 and 1 beforehand: statements that are all alike tell one number of the two."""


@dataclass(frozen=True)
class Scaling:
    """Platt's: logit p' = shift + slope logit p."""

    shift: float = 0.0
    slope: float = 1.0

    def of(self, probabilities: Array) -> Array:
        """Probabilities (N,) as they should have been stated."""
        return np.asarray(expit(self.shift + self.slope * logit(np.clip(probabilities, EDGE, 1 - EDGE))))


@dataclass(frozen=True)
class LeftOut:
    """A source with probabilities calibrated on the others.

    Attributes:
        statements: of the source.
        scaling: fitted to the others.
        error, stated_error: expected calibration error with it, and as stated.
        log_score, stated_log_score: mean log of the probability of what was true, likewise [nat].
        base_log_score: the same of the share that is right in the others, whatever is stated [nat].
    """

    statements: int
    scaling: Scaling
    error: float
    stated_error: float
    log_score: float
    stated_log_score: float
    base_log_score: float


def each_left_out(sources: Mapping[str, Sequence[Statement]]) -> dict[str, LeftOut]:
    """Every source that states something, beside others that do; none where there is only one."""
    stating = {name: own for name, own in sources.items() if own}
    if len(stating) < 2:
        return {}
    return {
        name: _left_out(own, [one for other, each in stating.items() if other != name for one in each])
        for name, own in stating.items()
    }


def scaling_of(statements: Sequence[Statement]) -> Scaling:
    """The most probable scaling, normal about none beforehand."""
    stated, right = _apart(statements)

    def cost(numbers: Array) -> float:
        scaled = Scaling(*numbers.tolist()).of(stated)
        prior = np.sum(np.square((numbers - (0.0, 1.0)) / PRIOR_STD)) / 2
        return float(prior - len(stated) * log_score(scaled, right))

    found = optimize.minimize(cost, np.array([0.0, 1.0]), method="Nelder-Mead", bounds=[(None, None), (0.0, None)])
    return Scaling(*found.x.tolist())


def log_score(probabilities: Array, right: NDArray[np.bool_]) -> float:
    """Mean log of the probability of what was true [nat]."""
    held = np.clip(probabilities, EDGE, 1 - EDGE)
    return float(np.mean(np.log(np.where(right, held, 1 - held))))


def _left_out(own: Sequence[Statement], others: Sequence[Statement]) -> LeftOut:
    stated, right = _apart(own)
    scaling = scaling_of(others)
    scaled, base = scaling.of(stated), np.full(len(own), np.mean(_apart(others)[1]))
    return LeftOut(
        statements=len(own),
        scaling=scaling,
        error=_error(scaled, right),
        stated_error=_error(stated, right),
        log_score=log_score(scaled, right),
        stated_log_score=log_score(stated, right),
        base_log_score=log_score(base, right),
    )


def _apart(statements: Sequence[Statement]) -> tuple[Array, NDArray[np.bool_]]:
    stated, right = zip(*statements, strict=True)
    return np.array(stated, dtype=float), np.array(right, dtype=bool)


def _error(probabilities: Array, right: NDArray[np.bool_]) -> float:
    return calibration_error(reliability(probabilities.tolist(), right.tolist()))

"""Numbers that a score is made of: rates with their intervals, calibration of probabilities."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

Z95: Final = 1.959964
"""Quantile of the normal distribution for two-sided 95 %."""

BINS: Final = 5


@dataclass(frozen=True)
class Rate:
    """How often something happened.

    Attributes:
        hits: cases in which it did.
        cases: in which it could.
    """

    hits: int
    cases: int

    @property
    def value(self) -> float:
        """Share [-], NaN without cases."""
        return self.hits / self.cases if self.cases else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's 95 % interval (Wilson 1927)."""
        if not self.cases:
            return 0.0, 1.0
        n, p = self.cases, self.value
        centre = p + Z95**2 / (2 * n)
        half = Z95 * math.sqrt(p * (1 - p) / n + Z95**2 / (4 * n**2))
        scale = 1 + Z95**2 / n
        return max((centre - half) / scale, 0.0), min((centre + half) / scale, 1.0)

    def __str__(self) -> str:
        low, high = self.interval
        return f"{self.value:.2f} [{low:.2f}, {high:.2f}] ({self.hits}/{self.cases})" if self.cases else "no cases"


def rate(outcomes: Sequence[bool]) -> Rate:
    """Share of outcomes that are true."""
    return Rate(sum(outcomes), len(outcomes))


@dataclass(frozen=True)
class Bin:
    """Cases of similar stated probability.

    Attributes:
        stated: mean probability stated.
        right: how often it was right.
    """

    stated: float
    right: Rate


def reliability(probabilities: Sequence[float], right: Sequence[bool], bins: int = BINS) -> list[Bin]:
    """Bins of equal mass, lowest probability first; fewer where there are fewer cases than bins."""
    order = np.argsort(probabilities, kind="stable")
    parts = [part for part in np.array_split(order, bins) if part.size]
    stated, hits = np.asarray(probabilities, dtype=float), np.asarray(right, dtype=bool)
    return [Bin(float(stated[part].mean()), rate(hits[part].tolist())) for part in parts]


def calibration_error(bins: Sequence[Bin]) -> float:
    """Expected calibration error: mean distance of stated probability and share of right ones, by mass."""
    total = sum(each.right.cases for each in bins)
    if not total:
        return math.nan
    return sum(each.right.cases * abs(each.stated - each.right.value) for each in bins) / total

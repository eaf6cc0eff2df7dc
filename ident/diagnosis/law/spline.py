"""A smooth function of one variable: uniform cubic B-splines, and what is believed of it before the data.

The coefficients have the covariance of a Gaussian process with a squared-exponential kernel (Rasmussen and Williams
2006, chapter 4): its length says how fast the function may change. Outside its knots the function keeps its last value.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.effects.laws import COUNT

Array = NDArray[np.float64]

LEAST_POWER: Final = 1e-6
"""Of a direction of the prior, relative to the largest, below which it is left out."""


@dataclass(frozen=True)
class Knots:
    """Where the coefficients of a function stand.

    Attributes:
        start: of the first one, a step before the range begins.
        step: between them.
        period: of the variable; 0 where it does not come around. The steps then go once around.
        shortest: length over which the function may change, over its period or the range of its variable.
    """

    start: float
    step: float
    period: float = 0.0
    shortest: float = 0.0

    @property
    def places(self) -> Array:
        """(COUNT,) of the coefficients."""
        return np.asarray(self.start + self.step * np.arange(COUNT), dtype=np.float64)

    @property
    def ends(self) -> tuple[float, float]:
        """Range of the variable."""
        return self.start + self.step, self.start + self.step * (COUNT - 2)

    def basis(self, x: Array) -> Array:
        """Values (..., COUNT) of the B-splines at x (...): of each x, four are not zero."""
        whole = np.ravel(x if self.period else np.clip(x, *self.ends))
        place = (whole - self.start) / self.step
        first = np.floor(place).astype(np.int64)
        if not self.period:
            first = np.clip(first, 1, COUNT - 3)
        t = place - first
        weights = ((1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3)
        found = np.zeros((len(whole), COUNT))
        rows = np.arange(len(whole))
        for index, weight in enumerate(weights):
            found[rows, (first + index - 1) % COUNT] = weight / 6
        return found.reshape(*np.shape(x), COUNT)

    def prior(self, share: float) -> Array:
        """Factor L (COUNT, R) of the covariance L Lᵀ of the coefficients, of unit variance about a straight line.

        The line has unit variance too: where the fitted rows end, the function goes on straight.

        Args:
            share: length over which the function changes, over its period or the range of its variable.
        """
        return _around(share) if self.period else _along(share)


@cache
def _along(share: float) -> Array:
    """The factor of a function of a range."""
    along = np.linspace(-1.0, 1.0, COUNT)
    steps = np.arange(COUNT)
    return np.column_stack([_wave(np.subtract.outer(steps, steps) / (COUNT - 3), share), np.ones(COUNT), along])


@cache
def _around(share: float) -> Array:
    """The factor of a function that comes around."""
    steps = np.arange(COUNT)
    return _wave(np.sin(np.pi * np.subtract.outer(steps, steps) / COUNT) / np.pi, share)


def _wave(distance: Array, share: float) -> Array:
    """Factor of a covariance that falls with the distance (COUNT, COUNT) over a length."""
    powers, vectors = np.linalg.eigh(np.exp(-0.5 * (distance / share) ** 2))
    kept = powers > LEAST_POWER * powers.max()
    return np.asarray(vectors[:, kept] * np.sqrt(powers[kept]))


def knots_over(low: float, high: float, shortest: float = 0.0) -> Knots:
    """Knots of a range."""
    step = (high - low) / (COUNT - 3)
    return Knots(low - step, step, shortest=shortest)


def knots_around(period: float) -> Knots:
    """Knots of a variable that comes around."""
    return Knots(0.0, period / COUNT, period)

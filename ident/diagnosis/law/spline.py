"""A smooth function of one variable: uniform cubic B-splines, and what is believed of it before the data.

The coefficients have the covariance of a Gaussian process with a squared-exponential kernel (Rasmussen and Williams
2006, chapter 4): its length says how fast the function may change. Outside its knots the function keeps its last value.
"""

from __future__ import annotations

from dataclasses import dataclass
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
    """

    start: float
    step: float
    period: float = 0.0

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

    def prior(self, length: float) -> Array:
        """Factor L (COUNT, R) of the covariance L Lᵀ of the coefficients, of unit variance about a straight line.

        The line has unit variance too: where the fitted rows end, the function goes on straight.

        Args:
            length: over which the function changes, in the unit of the variable.
        """
        distance = self.places[:, None] - self.places
        if self.period:
            distance = self.period / np.pi * np.sin(np.pi * distance / self.period)
        powers, vectors = np.linalg.eigh(np.exp(-0.5 * (distance / length) ** 2))
        kept = powers > LEAST_POWER * powers.max()
        wave = vectors[:, kept] * np.sqrt(powers[kept])
        if self.period:
            return np.asarray(wave)
        along = np.linspace(-1.0, 1.0, COUNT)
        return np.column_stack([wave, np.ones(COUNT), along])


def knots_over(low: float, high: float) -> Knots:
    """Knots of a range."""
    step = (high - low) / (COUNT - 3)
    return Knots(low - step, step)


def knots_around(period: float) -> Knots:
    """Knots of a variable that comes around."""
    return Knots(0.0, period / COUNT, period)

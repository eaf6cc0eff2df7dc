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
        """Values (..., COUNT) of the B-splines at x (...)."""
        if self.period:
            turns = (np.asarray(x)[..., None] - self.places) / self.period
            u = (turns - np.round(turns)) * self.period / self.step
        else:
            u = (np.clip(x, *self.ends)[..., None] - self.places) / self.step
        return kernel(u)

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


def kernel(u: Array) -> Array:
    """The uniform cubic B-spline, (2 - |u|)³/6 outside of 1 and within 2; the sum over all integers is 1."""
    size = np.abs(u)
    return np.asarray((np.maximum(2 - size, 0) ** 3 - 4 * np.maximum(1 - size, 0) ** 3) / 6)


def knots_over(low: float, high: float) -> Knots:
    """Knots of a range."""
    step = (high - low) / (COUNT - 3)
    return Knots(low - step, step)


def knots_around(period: float) -> Knots:
    """Knots of a variable that comes around."""
    return Knots(0.0, period / COUNT, period)

"""Free functions of one variable: a Gaussian process as a Fourier series beyond its range, and its lengths.

The process is squared-exponential. Over a range L it is written in cosines and sines of the period 2 L, so that its
ends are free of each other (Solin and Särkkä 2020, Hilbert space approximate Gaussian processes).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.core.observations import Observation
from ident.diagnosis.law.dependence import Partner, Variable

Array = NDArray[np.float64]

WAVES: Final = 45
"""Half periods over the range: as short as the shortest length resolves."""

SHORTEST: Final = 0.03
"""Length of a function over its range, at least: what WAVES resolve to a thousandth."""

LENGTHS: Final = 6
"""Tried between that and the range itself, every factor as likely."""


LEAST: Final = 1e-6
"""Share of the power of a function that a column must have: less changes no row."""


@dataclass(frozen=True)
class Function:
    """f(variable) times partner.

    Attributes:
        variable, partner: by name.
        argument: observation -> (N,) of the variable.
        factor: observation -> (N,) of the partner; None: one.
    """

    variable: Variable
    partner: Partner
    argument: Callable[[Observation], Array]
    factor: Callable[[Observation], Array] | None = None


@dataclass(frozen=True)
class Waves:
    """Basis of a function over a range; beyond it, the last value.

    Attributes:
        function: what it is a basis of.
        low, high: of the variable in the rows.
    """

    function: Function
    low: float
    high: float

    def at(self, x: Array) -> Array:
        """(..., K) cosines of half periods of twice the range, from the constant on."""
        share = (np.clip(x, self.low, self.high) - self.low) / (self.high - self.low)
        return np.cos(np.pi / BEYOND * np.multiply.outer(share + (BEYOND - 1) / 2, np.arange(WAVES + 1)))

    def columns(self, observation: Observation) -> Array:
        """(N, K) unfiltered."""
        columns = self.at(self.function.argument(observation))
        factor = self.function.factor
        return columns if factor is None else factor(observation)[:, None] * columns


BEYOND: Final = 1.5
"""Length over which the cosines stand, over the range: their slope is zero at the ends of it, not of the range."""


def waves(function: Function, observations: Sequence[Observation]) -> Waves:
    """Basis over what the rows show of a variable."""
    arguments = [one.at_rows(function.argument(one)) for one in observations]
    return Waves(function, min(float(x.min()) for x in arguments), max(float(x.max()) for x in arguments))


def process_factors() -> tuple[Array, tuple[Array, ...]]:
    """Lengths over the range, and the factor (K, R) of the prior of each, of unit variance."""
    lengths = np.geomspace(SHORTEST, 1.0, LENGTHS)
    angular = np.pi / BEYOND * np.arange(WAVES + 1)
    return lengths, tuple(_factor(np.exp(-0.5 * (angular * length) ** 2)) for length in lengths)


def _factor(power: Array) -> Array:
    """(K, R) of independent columns of some power (K,), without those that have none."""
    share = power / power.sum()
    return np.diag(np.sqrt(share))[:, share > LEAST]


TAPS: Final = 20
"""Rows before and behind, of a free filter of the load: six periods of the bandwidth."""


def filter_taps(observation: Observation) -> Array:
    """(N, 2 TAPS + 1) the load, so many rows earlier and later."""
    effort, stride = observation.effort, round(observation.stride / observation.interval)
    padded = np.pad(effort, TAPS * stride, mode="edge")
    return np.column_stack([padded[tap * stride : tap * stride + len(effort)] for tap in range(2 * TAPS + 1)])


def filter_factors() -> tuple[Array, tuple[Array, ...]]:
    """Memories in rows over TAPS, and the diagonal factor of the prior of each, of unit variance."""
    memories = np.geomspace(2 / TAPS, 1.0, LENGTHS)
    distance = np.abs(np.arange(-TAPS, TAPS + 1)) / TAPS
    powers = [np.exp(-0.5 * (distance / memory) ** 2) for memory in memories]
    return memories, tuple(map(_factor, powers))


FILTER: Final = Function(Variable.LOAD_SECOND_RATE, Partner.NOTHING, lambda one: one.effort_rate)
"""Names a free filter of the load; lag and inertia are part of the plant, so that it begins with the second rate."""


def _direction(one: Observation) -> Array:
    return one.direction


FUNCTIONS: Final[Sequence[Function]] = (
    Function(Variable.RATE, Partner.NOTHING, lambda one: one.velocity),
    Function(Variable.ANGLE, Partner.NOTHING, lambda one: one.position),
    Function(Variable.ANGLE, Partner.DIRECTION, lambda one: one.position, _direction),
    Function(Variable.ANGLE, Partner.ACCELERATION, lambda one: one.position, lambda one: one.acceleration),
    Function(Variable.TIME, Partner.NOTHING, lambda one: one.time),
    Function(Variable.TIME, Partner.DIRECTION, lambda one: one.time, _direction),
    Function(Variable.PATH_SINCE_REVERSAL, Partner.DIRECTION, lambda one: one.path, _direction),
)

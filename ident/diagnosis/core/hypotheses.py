"""Hypotheses: what may be missing in the plant of an axis, as columns in the rows, and what is believed before them.

A named hypothesis is a family of few columns and at most one number more, tried between the ends that the record can
show. A free function is a Gaussian process of one variable, whose length stands in the place of that number.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.axis.model import AxisEffect
from ident.diagnosis.core.functions import (
    FILTER,
    FUNCTIONS,
    Function,
    filter_factors,
    filter_taps,
    process_factors,
    waves,
)
from ident.diagnosis.core.observations import MASS, Observation
from ident.diagnosis.delays import RARER, compliant, delayed, led, sprung
from ident.diagnosis.names import EffectName

Array = NDArray[np.float64]
Observations = Sequence[Observation]
Parameters = tuple[tuple[str, str], ...]

EVERY: Final = 1.2
"""Ratio of neighbouring numbers of a family on a logarithmic grid; between them it is refined."""

RIGID: Final = 100.0
"""Resonance over the bandwidth, of a spring that shows as a compliance alone: it adds a ten-thousandth else."""

DAMPING: Final = 0.03
"""Of what is behind a spring, over the critical damping: what bolted steel has. Less would let the noise of a position,
and the unknown motion of the load before the record, ring on in what is reckoned from it."""


@dataclass(frozen=True)
class Hypothesis:
    """A cause that may be there.

    Attributes:
        name: of the library, or `law`.
        numbers: (G,) of the family, or lengths of the function over its range; one NaN where there is none.
        series: observation and number -> (N, k) unfiltered columns.
        factors: (K, R) of the prior covariance of the columns by number; empty: the columns are independent.
        function: of which it is one, for a law.
        response: angular frequencies (F,) and number -> what a coefficient of one adds to the inertia, over it: the
            noise of the acceleration is amplified by as much. Its size goes with the square of the inertia then.
        parameters: of a name, each with its unit, u for that of the effort and q for that of the position.
    """

    name: str
    numbers: Array
    series: Callable[[Observation, float], Array]
    factors: tuple[Array, ...] = ()
    function: Function | None = None
    response: Callable[[Array, float], NDArray[np.complex128]] | None = None
    parameters: Parameters = ()

    @property
    def free(self) -> bool:
        """Whether it is a law without a name; its columns are the same for every number."""
        return self.function is not None


def hypotheses(observations: Observations, lacking: Collection[str] = ()) -> tuple[Hypothesis, ...]:
    """All that are tried, by name without those lacking."""
    named = [family(observations) for family in _FAMILIES]
    free = [_free(function, observations) for function in FUNCTIONS]
    memories, factors = filter_factors()
    free.append(Hypothesis("law", memories, lambda one, _: filter_taps(one), factors, FILTER))
    return tuple(one for one in [*named, *free] if one.name not in lacking)


def _free(function: Function, observations: Observations) -> Hypothesis:
    basis = waves(function, observations)
    lengths, factors = process_factors()
    return Hypothesis("law", lengths, lambda one, _: basis.columns(one), factors, function)


def _one(
    name: str, parameter: str, unit: str, series: Callable[[Observation], Array]
) -> Callable[[Observations], Hypothesis]:
    """A family of one column (N,)."""
    alone, stated = np.array([np.nan]), ((parameter, unit),)
    return lambda _: Hypothesis(name, alone, lambda one, _number: series(one)[:, None], parameters=stated)


def _between(low: float, high: float) -> Array:
    count = 1 + max(1, round(np.log(max(high / low, 1.0)) / np.log(EVERY)))
    return np.geomspace(low, high, count)


def _slowest(observations: Observations) -> float:
    """Speed of the slowest row."""
    return min(float(np.abs(one.at_rows(one.velocity)).min()) for one in observations)


def _fastest(observations: Observations) -> float:
    return max(float(np.abs(one.at_rows(one.velocity)).max()) for one in observations)


def _reach(observations: Observations) -> float:
    return max(float(np.ptp(one.position)) for one in observations)


def _stribeck(observations: Observations) -> Hypothesis:
    def series(one: Observation, speed: float) -> Array:
        velocity = one.velocity
        return (one.direction * np.exp(-np.square(velocity / speed)))[:, None]

    speeds = _between(_slowest(observations), _fastest(observations))
    return Hypothesis(EffectName.STRIBECK, speeds, series, parameters=(("amplitude", "u"), ("velocity", "q/s")))


def _presliding(observations: Observations) -> Hypothesis:
    def series(one: Observation, distance: float) -> Array:
        return (one.direction * np.exp(-one.path / distance))[:, None]

    shortest = min(float(one.at_rows(one.path).min()) for one in observations)
    reach = _reach(observations)
    paths = _between(max(shortest, reach / 1000), reach)
    return Hypothesis(EffectName.PRESLIDING, paths, series, parameters=(("amplitude", "u"), ("distance", "q")))


def _warming(observations: Observations) -> Hypothesis:
    def series(one: Observation, constant: float) -> Array:
        return np.asarray(one.direction * (1 - np.exp(-one.time / constant)))[:, None]

    longest = max(float(one.time[-1]) for one in observations)
    times = _between(longest / len(observations[0]) * 3, longest)
    return Hypothesis(AxisEffect.FRICTION_WARMING, times, series, parameters=(("change", "u"), ("time", "s")))


def _ripple(observations: Observations) -> Hypothesis:
    """Orders in periods a unit of position; half of the rows see the fastest, four are tried a period of the reach."""

    def series(one: Observation, order: float) -> Array:
        angle = 2 * np.pi * order * one.position
        return np.column_stack([np.sin(angle), np.cos(angle)])

    reach, usual = _reach(observations), float(np.median(np.abs(observations[0].velocity)))
    most = observations[0].filter.bandwidth / (2 * np.pi * usual)
    orders = np.arange(4.0, max(4 * reach * most, 5.0)) / (4 * reach)
    stated = (("amplitude", "u"), ("order", "1/q"), ("phase", "rad"))
    return Hypothesis(EffectName.TORQUE_RIPPLE, orders, series, parameters=stated)


def _elasticity(observations: Observations) -> Hypothesis:
    def series(one: Observation, resonance: float) -> Array:
        force = one.values[MASS] * one.acceleration
        return np.asarray(one.values[MASS] * sprung(force, resonance, one.interval, DAMPING))[:, None]

    def response(angular: Array, resonance: float) -> NDArray[np.complex128]:
        return np.asarray(observations[0].values[MASS] * compliant(angular, resonance, DAMPING))

    band = observations[0].filter.bandwidth
    # A resonance is as wide as its damping: from beside it, nothing leads there.
    count = round(math.log(RIGID) / 2 / (2 * DAMPING))
    resonances = np.append(np.geomspace(band / 2, math.sqrt(RIGID) / 2 * band, count), RIGID * band)
    stated = (("compliance", "q/u"), ("resonance", "rad/s"))
    return Hypothesis(EffectName.ELASTICITY, resonances, series, response=response, parameters=stated)


def _centred(one: Observation) -> Array:
    position = one.position
    return np.asarray(position - (position.max() + position.min()) / 2)


def following(one: Observation) -> Array:
    """(M,) what a filter of the lag's time constant adds to an effort that is that late."""
    return led(delayed(one.effort, one.lag, one.interval), one.lag, one.interval) - one.effort


_FAMILIES: Final[Sequence[Callable[[Observations], Hypothesis]]] = (
    _stribeck,
    _one(EffectName.ASYMMETRIC_VISCOUS, "imbalance", "u s/q", lambda one: np.abs(one.velocity)),
    _one(EffectName.QUADRATIC_DRAG, "coefficient", "u s^2/q^2", lambda one: one.velocity * np.abs(one.velocity)),
    _ripple,
    _elasticity,
    _presliding,
    _warming,
    _one(EffectName.FRICTION_POSITION, "slope", "u/q", lambda one: _centred(one) * one.direction),
    _one(EffectName.FRICTION_LOAD, "share", "1", lambda one: np.abs(one.effort) * one.direction),
    _one(AxisEffect.GRAVITY_LOAD, "slope", "u/q", _centred),
    _one(AxisEffect.INERTIA_POSITION, "slope", "u s^2/q^2", lambda one: _centred(one) * one.acceleration),
)


@dataclass(frozen=True)
class Late:
    """What makes an effort late beyond what sampling does.

    Attributes:
        parameter: its time [s].
        led: whether the effort follows by a filter, whose second order is another one.
        rarer: log odds against a plain delay, before the rows.
    """

    parameter: str
    led: bool = False
    rarer: float = 0.0


LATE: Final[Mapping[str, Late]] = MappingProxyType(
    {EffectName.TIME_DELAY: Late("delay"), EffectName.TORQUE_FILTER: Late("time", led=True, rarer=RARER)}
)
"""By name; beside the hypotheses with columns."""

"""Noise of the rows: white noise of effort and encoder as the filter colours it, slow drift, and what is not known.

The covariance is w (R_effort + ρ R_drift) + R_encoder + Z Zᵀ. What the filter makes of white noise is known, so
that colour is no free function; a drift of some corner frequency has whatever power the rows show.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import fft, linalg

from ident.diagnosis.core.observations import MASS, Observation

Array = NDArray[np.float64]

CORNERS: Final = 3
"""Corner frequencies of a drift that are tried, between one turn in the record and the bandwidth."""

POWERS: Final = (0.1, 1.0, 10.0, 100.0)
"""Of a drift in the rows over that of the noise, tried; what is far less changes nothing."""

SCALED: Final = 3
"""Times that the level of the noise is corrected."""

HELD: Final = 1 / 24
"""Of T²/M, the compliance that an effort seems to have that is held over a sample interval T: (ωT)²/24."""

JITTER: Final = 1e-6
"""White share of the rows' noise, so that a band without any power is not blown up."""


@dataclass(frozen=True)
class Drift:
    """Slow noise: a corner frequency [rad/s] and its power in the rows over that of the noise; 0 for none."""

    corner: float
    power: float


class Colours:
    """Covariances of the rows of one record."""

    def __init__(self, observation: Observation) -> None:
        gain = observation.filter.gain(observation.count, observation.sample_time)
        self._frequency = np.pi * np.arange(len(gain)) / (len(gain) * observation.sample_time)
        self._gain, self._lags = gain, np.abs(np.subtract.outer(observation.samples, observation.samples))
        effort = self._autocovariance(np.ones_like(gain))
        encoder = self._autocovariance((observation.values[MASS] * self._frequency**2) ** 2)
        unsure = np.column_stack([observation.unsure, _held(observation)])
        self._effort = effort[self._lags] / effort[0] + JITTER * np.eye(len(observation))
        self._known = observation.encoder**2 * encoder[self._lags] + unsure @ unsure.T

    def covariance(self, drift: Drift, level: float) -> Array:
        """(n, n) of the rows, over the power `level` of the effort's noise in a row."""
        found = self._effort + self._known / level
        if not drift.power:
            return found
        slow = self._autocovariance(1 / (1 + (self._frequency / drift.corner) ** 2))
        return np.asarray(found + drift.power * slow[self._lags] / slow[0])

    def _autocovariance(self, spectrum: Array) -> Array:
        """By lag in samples, of noise with a spectrum behind the filter."""
        return np.asarray(fft.idct(self._gain**2 * spectrum, type=1))


def _held(observation: Observation) -> Array:
    """(n,) what it adds that an effort may be held over a sample interval."""
    interval = observation.sample_time
    bent = np.gradient(observation.effort_rate, observation.interval)
    return HELD * interval**2 * observation.rows(bent)


def drifts(observation: Observation) -> Iterator[Drift]:
    """None, and all that are tried."""
    yield Drift(0.0, 0.0)
    slowest = 2 * np.pi / (observation.count * observation.sample_time)
    for corner in np.geomspace(slowest, observation.filter.bandwidth, CORNERS + 1)[:-1]:
        for power in POWERS:
            yield Drift(float(corner), power)


@dataclass(frozen=True)
class Whitener:
    """Of the rows of one record.

    Attributes:
        factor: (n, n) lower triangular, of the covariance.
        level: power of the noise of the effort in a row.
        drift: beside it.
        log_likelihood: of the rows, restricted to what their design does not absorb.
    """

    factor: Array
    level: float
    drift: Drift
    log_likelihood: float

    def white(self, columns: Array) -> Array:
        """Columns (n, k) in units of the noise."""
        return np.asarray(linalg.solve_triangular(self.factor, columns, lower=True) / math.sqrt(self.level))


def fit_whitener(observation: Observation, colours: Colours, design: Array, start: float) -> Whitener:
    """The most likely noise of a record beside columns (n, k).

    Args:
        observation: with the rows.
        colours: of its noise.
        design: columns that are absorbed, whatever their size.
        start: power of the noise of a row that is tried first.
    """
    found = [_levelled(observation, colours, design, start, drift) for drift in drifts(observation)]
    return max(found, key=lambda one: one.log_likelihood)


def _levelled(observation: Observation, colours: Colours, design: Array, level: float, drift: Drift) -> Whitener:
    for _ in range(SCALED):
        whitener, power = _with(observation, colours, design, level, drift)
        level *= power
    return whitener


def _with(
    observation: Observation, colours: Colours, design: Array, level: float, drift: Drift
) -> tuple[Whitener, float]:
    """Whitener of a level, and the power of the white rows, by which the level is too small."""
    factor = linalg.cholesky(colours.covariance(drift, level), lower=True, check_finite=False)
    white = linalg.solve_triangular(factor, np.column_stack([design, observation.target]), lower=True)
    turned = linalg.qr(white, mode="r")[0]
    width = design.shape[1]
    count, left = len(white) - width, float(turned[width, width] ** 2) / level
    volume = float(np.sum(np.log(np.diag(factor))) + np.sum(np.log(np.abs(np.diag(turned)[:width]))))
    log = -0.5 * left - 0.5 * count * math.log(level) - volume
    return Whitener(factor, level, drift, log), left / count

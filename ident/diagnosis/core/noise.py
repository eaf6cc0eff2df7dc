"""Noise of the rows: white noise of effort and encoder as the filter colours it, slow drift, and what is not known.

The covariance is w (R_effort + ρ R_drift) + R_encoder + Z Zᵀ. What the filter makes of white noise is known, so
that colour is no free function; a drift of some corner frequency has whatever power the rows show.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, replace
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

SCALED: Final = 2
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


NONE: Final = Drift(0.0, 0.0)


class Colours:
    """Covariances of the rows of one record."""

    def __init__(self, observation: Observation) -> None:
        gain = observation.filter.gain(observation.count, observation.sample_time)
        frequency = np.pi * np.arange(len(gain)) / (len(gain) * observation.sample_time)
        self._frequency: Array = np.asarray(frequency, dtype=np.float64)
        self._gain, self._lags = gain, np.abs(np.subtract.outer(observation.samples, observation.samples))
        effort = self._autocovariance(np.ones_like(gain))
        unsure = np.column_stack([observation.unsure, _held(observation)])
        self._effort = effort[self._lags] / effort[0] + JITTER * np.eye(len(observation))
        self._kept: dict[float, Array] = {}
        self._encoder = (observation.encoder * observation.values[MASS] * self._frequency**2) ** 2
        self._unsure = unsure @ unsure.T
        self._known = self._autocovariance(self._encoder)[self._lags] + self._unsure

    def amplified(self, response: Callable[[Array], NDArray[np.complex128]]) -> Colours:
        """The same, the noise of the encoder amplified by one and a response at frequencies (F,) [rad/s]."""
        found = copy(self)
        more = self._encoder * np.abs(1 + response(self._frequency)) ** 2
        found._known = self._autocovariance(more)[self._lags] + self._unsure
        return found

    def covariance(self, drift: Drift, level: float) -> Array:
        """(n, n) of the rows, over the power `level` of the effort's noise in a row."""
        found: Array = self._effort + self._known / level
        if not drift.power:
            return found
        return np.asarray(found + drift.power * self._slow(drift.corner))

    def _slow(self, corner: float) -> Array:
        if corner not in self._kept:
            slow = self._autocovariance(1 / (1 + (self._frequency / corner) ** 2))
            self._kept[corner] = slow[self._lags] / slow[0]
        return self._kept[corner]

    def _autocovariance(self, spectrum: Array) -> Array:
        """By lag in samples, of noise with a spectrum behind the filter."""
        return np.asarray(fft.idct(self._gain**2 * spectrum, type=1))


def _held(observation: Observation) -> Array:
    """(n,) what it adds that an effort may be held over a sample interval."""
    return HELD * observation.sample_time**2 * observation.bent[:, 0]


def drifts(observation: Observation) -> list[Drift]:
    """None, and all that are tried."""
    slowest = 2 * np.pi / (observation.count * observation.sample_time)
    corners = np.geomspace(slowest, observation.filter.bandwidth, CORNERS + 1)[:-1]
    return [NONE, *(Drift(float(corner), power) for corner in corners for power in POWERS)]


@dataclass(frozen=True)
class Whitener:
    """Of the rows of one record.

    Attributes:
        factor: (n, n) lower triangular, of the covariance.
        level: power of the noise of the effort in a row.
        drift: beside it.
    """

    factor: Array
    level: float
    drift: Drift

    def white(self, columns: Array) -> Array:
        """Columns (n, k) in units of the noise."""
        return np.asarray(linalg.solve_triangular(self.factor, columns, lower=True) / math.sqrt(self.level))

    def tempered(self, temperature: float) -> Whitener:
        """The same, everything being that many times the power."""
        return replace(self, level=self.level * temperature)


@dataclass(frozen=True)
class Rows:
    """Rows of one record, whose noise is looked for.

    Attributes:
        colours: of the noise.
        design: (n, p) columns that are absorbed, whatever their size.
        target: (n,).
        members: (n, m) columns beside the noise, of unit variance.
    """

    colours: Colours
    design: Array
    target: Array
    members: Array


def fit_whitener(rows: Rows, tried: Sequence[Drift], level: float) -> Whitener:
    """The most likely noise of a record.

    Args:
        rows: of it.
        tried: drifts, the first of them the most likely.
        level: power of the noise of a row, to begin with.
    """
    beside = rows.members @ rows.members.T
    for _ in range(SCALED):
        level *= _power(rows, rows.colours.covariance(tried[0], level) + beside / level, level)[0]
    found = {}
    for drift in tried:
        power, log = _power(rows, rows.colours.covariance(drift, level) + beside / level, level)
        found[drift] = log - (math.log(len(POWERS) * CORNERS) if drift.power else 0.0), power
    best = max(found, key=lambda drift: found[drift][0])
    level *= found[best][1]
    factor = linalg.cholesky(rows.colours.covariance(best, level), lower=True, check_finite=False)
    return Whitener(factor, level, best)


def _power(rows: Rows, covariance: Array, level: float) -> tuple[float, float]:
    """Of the white rows of a covariance, by which the level is too small, and their log likelihood."""
    factor = linalg.cholesky(covariance, lower=True, check_finite=False)
    white = linalg.solve_triangular(factor, np.column_stack([rows.design, rows.target]), lower=True)
    turned = linalg.qr(white, mode="r")[0]
    width = rows.design.shape[1]
    count, left = len(white) - width, float(turned[width, width] ** 2) / level
    volume = float(np.sum(np.log(np.diag(factor))) + np.sum(np.log(np.abs(np.diag(turned)[:width]))))
    return left / count, -0.5 * left - 0.5 * count * math.log(level) - volume

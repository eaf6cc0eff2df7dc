"""Observations: what a record of an axis says, as rows of the plant's equation behind one zero-phase filter.

A row is F(motion) = effort at one moment, both sides filtered alike: below the bandwidth, and mirrored at the ends, so
that the filter is a product in the cosine transform. Rows stand where the axis moves, a stride apart. What hypotheses
are written in, the smoothed motion, is kept at the few samples that it needs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import fft, signal

from ident.diagnosis.axis.motion import AxisMotion, axis_motion
from ident.diagnosis.axis.reference import Reference, axis_reference, refuse_other_axes
from ident.diagnosis.axis.reversals import Sticking, turned_round, untold_while_sticking
from ident.diagnosis.delays import delayed
from ident.diagnosis.law.dependence import path_since_reversal
from ident.diagnosis.rows import ROWS_PER_CUTOFF
from ident.errors import RecordError
from ident.estimate.axis.processing import BUTTERWORTH_ORDER
from ident.estimate.filters import FILTER_ORDER, SEVEN, differentiate, filter_weights
from ident.records.axis_record import AxisKind, AxisRecord

Array = NDArray[np.float64]

LAGS: Final = 3
"""Times that a record is shifted by the lag that is then left: each leaves its square over the motion's period."""

SEGMENT: Final = 64
"""Samples of a spectrum's segments: few, so that most of them hold no reversal."""

COARSE: Final = 2.0
"""Samples of the smoothed motion that are kept in the time of its filter, 1/cutoff: Nyquist lies six times as high."""

FORGOTTEN: Final = 25.0
"""Time constants of the rows' filter after which 2e-8 is left of a sample."""

MASS, RATE, DIRECTION, OFFSET = range(4)
"""Columns of the plant M a + Fv v + Fc sign(v) + offset."""


@dataclass(frozen=True)
class Filter:
    """Both filters that rows have passed.

    Attributes:
        cutoff, bandwidth: of the position and of the rows [rad/s].
    """

    cutoff: float
    bandwidth: float

    def gain(self, count: int, sample_time: float) -> Array:
        """(count,) at the frequencies of a cosine transform: both of Butterworth's, there and back."""
        frequency = np.pi * np.arange(count) / (count * sample_time)
        return self.gain_at(np.asarray(frequency, dtype=np.float64))

    def gain_at(self, frequency: Array) -> Array:
        """(F,) at angular frequencies [rad/s]."""
        position = 1 + (frequency / self.cutoff) ** (2 * BUTTERWORTH_ORDER)
        return np.asarray(1 / position / (1 + (frequency / self.bandwidth) ** (2 * FILTER_ORDER)))

    def apply(self, series: Array, sample_time: float) -> Array:
        """A series (N, ...), as long as it was."""
        turned = fft.dct(series, axis=0, norm="ortho")
        gain = self.gain(len(series), sample_time).reshape(-1, *[1] * (series.ndim - 1))
        return np.asarray(fft.idct(gain * turned, axis=0, norm="ortho"))

    def weights(self, moments: Array, count: int, sample_time: float) -> Any:
        """(n, count) sparse, that makes rows at some moments (n,) [s] of a series of so many samples."""
        return filter_weights(self.gain_at, FORGOTTEN / self.bandwidth, moments, count, sample_time)


@dataclass(frozen=True)
class Observation:
    """One record of an axis.

    Attributes:
        filter: of the rows.
        motion: of the whole record.
        samples: (n,) of the rows in the record, `sample_time` [s] apart.
        count: samples of the record.
        stride: time between neighbouring rows [s].
        target: (n,) effort as it acts at the time of the positions.
        plant: (n, 4) columns of the plant.
        values: (4,) parameters of the plant, an estimate that columns are scaled with.
        lag: by which the effort was shifted [s].
        encoder: noise of a sample of the position [m or rad].
        unsure: (n, k) random effects of unit variance: when friction turns at a reversal, and the speed at both ends.
        interval: between samples of the smoothed motion [s].
        position, velocity, acceleration, direction: (M,) smoothed.
        weights: (n, M) sparse, makes rows of a series (M, ...).
    """

    filter: Filter
    motion: AxisMotion
    samples: NDArray[np.int64]
    sample_time: float
    count: int
    stride: float
    target: Array
    plant: Array
    values: Array
    lag: float
    encoder: float
    unsure: Array
    interval: float
    position: Array
    velocity: Array
    acceleration: Array
    direction: Array
    weights: Any

    def __len__(self) -> int:
        return len(self.samples)

    def rows(self, series: Array) -> Array:
        """Rows (n, ...) of a series (M, ...)."""
        return np.asarray(self.weights @ series)

    def at_rows(self, series: Array) -> Array:
        """Values (n,) of a series (M,) at the rows, unfiltered."""
        place = (self.samples + 0.5) * self.sample_time / self.interval
        return np.asarray(series[np.minimum(place.astype(np.int64), len(series) - 1)])

    @cached_property
    def effort(self) -> Array:
        """(M,) by the estimate [N or Nm]."""
        ones = np.ones_like(self.velocity)
        return np.column_stack([self.acceleration, self.velocity, self.direction, ones]) @ self.values

    @cached_property
    def effort_rate(self) -> Array:
        """(M,) its derivative [per s]."""
        return differentiate(self.effort, self.interval, SEVEN)

    @cached_property
    def late(self) -> Array:
        """(n,) what a lag of one second adds, in first order."""
        return self.rows(self.effort_rate)

    @cached_property
    def bent(self) -> Array:
        """(n, 2) second and third derivative of the effort, that a spring adds."""
        second = differentiate(self.effort_rate, self.interval, SEVEN)
        return self.rows(np.column_stack([second, differentiate(second, self.interval, SEVEN)]))

    @cached_property
    def path(self) -> Array:
        """(M,) since the last reversal [m or rad]."""
        return path_since_reversal(self.position, self.velocity)

    @cached_property
    def time(self) -> Array:
        """(M,) [s]."""
        return np.asarray(np.arange(len(self.velocity)) * self.interval, dtype=np.float64)


def observe(fit: Sequence[AxisRecord], confirm: Sequence[AxisRecord]) -> tuple[tuple[Observation, ...], AxisKind]:
    """Observations of all records, behind one filter, and how the axis moves.

    Raises:
        RecordError: the records do not have the same axis, or have several.
        EstimationError: a record is too short, or the axis does not move.
    """
    records = [*fit, *confirm]
    refuse_other_axes(records)
    if len(records[0].axes) != 1:
        raise RecordError(f"{records[0].source} has several axes.", "The core knows one: record or cut out one axis.")
    reference = axis_reference(fit, None, confirm)
    found = [_observation(record, reference) for record in records]
    for _ in range(LAGS):
        values, lags = _estimated(found)
        pairs = zip(found, records, strict=True)
        found = [_shifted(one, record, lags[record.sample_time], values) for one, record in pairs]
    return tuple(found), records[0].axes[0].kind


def rates_of(observations: Sequence[Observation]) -> list[float]:
    """Sample times of some records [s]: within each, a position may be read at another part of the interval."""
    return sorted({one.sample_time for one in observations})


def plant_columns(observation: Observation, rates: Sequence[float]) -> Array:
    """(n, 4 + R) of the plant, and of the lag at every rate."""
    late = [observation.late * (observation.sample_time == rate) for rate in rates]
    return np.column_stack([observation.plant, *late])


def _shifted(observation: Observation, record: AxisRecord, lag: float, values: Array) -> Observation:
    """With its effort taken earlier by a lag [s], and everything scaled by an estimate."""
    dt, whole = record.sample_time, observation.lag + lag
    effort = delayed(record.axes[0].effort, whole, dt)
    target = observation.filter.apply(effort, dt)[observation.samples]
    shifted = replace(observation, target=target, lag=whole, values=values)
    return replace(shifted, unsure=_unsure(shifted, observation.motion))


def _observation(record: AxisRecord, reference: Reference) -> Observation:
    filters = Filter(reference.cutoff, reference.bandwidth)
    dt = record.sample_time
    motion = axis_motion(record, record.axes[0], filters.cutoff, filters.bandwidth)
    stride = max(1, math.floor(2 * math.pi / (ROWS_PER_CUTOFF * filters.bandwidth * dt)))
    samples = np.arange(0, len(record), stride)
    samples = samples[motion.moving[samples]]
    block = max(1, math.floor(1 / (COARSE * filters.cutoff * dt)))
    signs = np.sign(motion.velocity)
    plant = np.column_stack([motion.linear, signs, np.ones_like(signs)])
    return Observation(
        filter=filters,
        motion=motion,
        samples=samples,
        sample_time=dt,
        count=len(record),
        stride=stride * dt,
        target=filters.apply(record.axes[0].effort, dt)[samples],
        plant=filters.apply(plant, dt)[samples],
        values=reference.scales[0].values,
        lag=0.0,
        encoder=_encoder_noise(record.axes[0].position),
        unsure=np.zeros((len(samples), 0)),
        interval=block * dt,
        position=_means(motion.position, block),
        velocity=_means(motion.velocity, block),
        acceleration=_means(motion.acceleration, block),
        direction=_means(signs, block),
        weights=filters.weights(np.asarray((samples + 0.5) * dt, dtype=np.float64), len(record) // block, block * dt),
    )


def _means(series: Array, block: int) -> Array:
    """(M,) of every so many samples."""
    return np.asarray(series[: len(series) // block * block].reshape(-1, block).mean(axis=1))


def _encoder_noise(position: Array) -> float:
    """Deviation of a sample of a position (N,), by the upper half of the band of its second differences."""
    bent = np.diff(position, 2)
    frequency, power = signal.welch(bent, nperseg=min(SEGMENT, len(bent)), average="median")
    upper = slice(len(power) // 2, None)
    return math.sqrt(0.5 * float(np.median(power[upper] / (2 * np.sin(np.pi * frequency[upper])) ** 4)))


def _estimated(observations: Sequence[Observation]) -> tuple[Array, dict[float, float]]:
    """(4,) parameters of the plant, and the lag that is left at every rate [s], beside a compliance and its rate."""
    rates = rates_of(observations)
    columns = np.vstack([np.column_stack([plant_columns(one, rates), one.bent]) for one in observations])
    size = np.linalg.norm(columns, axis=0)
    target = np.concatenate([one.target for one in observations])
    found = np.linalg.lstsq(columns / size, target, rcond=None)[0] / size
    lags = found[OFFSET + 1 : OFFSET + 1 + len(rates)]
    return np.asarray(found[: OFFSET + 1]), dict(zip(rates, lags.tolist(), strict=True))


def _unsure(observation: Observation, motion: AxisMotion) -> Array:
    dt, filters = observation.sample_time, observation.filter
    speed_noise = math.sqrt(2) * observation.encoder / dt
    sticking = Sticking(
        where=motion.sticking,
        friction=float(observation.values[DIRECTION]),
        noise=1.0,
        blur=1 / (filters.cutoff * dt),
        ends=turned_round(speed_noise, float(observation.values[MASS]), dt),
    )

    def filtered(series: Array) -> Array:
        return filters.apply(series, dt)

    found = untold_while_sticking(sticking, motion.moving, filtered, 1 / (filters.bandwidth * dt))
    return np.asarray(found.impulses[observation.samples].toarray())

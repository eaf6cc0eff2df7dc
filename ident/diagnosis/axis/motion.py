"""Speed and acceleration of an axis whose sampling, noise and repeats are not known beforehand."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, signal

from ident.diagnosis.observations.rows import ROWS_PER_CUTOFF
from ident.errors import EstimationError
from ident.estimate.axis.cutoff import SPECTRUM_SEGMENTS
from ident.estimate.axis.processing import smoothed
from ident.estimate.filters import SEVEN, differentiate
from ident.records.axis_record import AxisRecord, AxisSignals

Array = NDArray[np.float64]

ROWS_CUTOFF: Final = 0.4
"""Cutoff of the rows over that of the position filter: sign(v) then sees the velocity itself."""
LARGEST_ROWS_CUTOFF: Final = 1.0
"""Largest cutoff of the rows times the sample time."""
LEAST_ROWS: Final = 300
"""Rows that the shortest repeat, or a record without any, shall have."""
MOST_ROWS: Final = 4000
"""Rows of a repeat beyond which more say nothing new and take long."""
EFFORT_SHARE: Final = 0.99
"""Of the power of the effort that the rows keep. What lies above belongs to drives and structures, not to the axis."""
GUARDS: Final = (4.0, 2.0)
"""Time constants of the rows' filter around a reversal that have no rows, and where that leaves less than `AFFORDED`.

The rest is weighed out (`ident.diagnosis.axis.reversals`): less sure than not to have it, but better than no record.
"""
AFFORDED: Final = 0.5
"""Part of a record that shall have rows."""
STUCK_SPEED: Final = 0.01
"""Over the 95th percentile of the speed: below it an axis may stick."""
REPEAT_MISMATCH: Final = 0.03
"""Rms difference of two repeats of a motion over its standard deviation, at most."""
ALMOST_WHOLE: Final = 0.95
"""Part of a repeat that must be there for it to count."""
SMALLEST_MOTION: Final = 1e-9
REST: Final = 12.0
"""Range of a position over its noise, as its second differences show it, below which it does not move: a million
samples of white noise have a range of 10."""
FEWEST_ROWS: Final = 60
"""Independent rows that a diagnosis needs."""
LEAST_BAND: Final = 1.2 * FEWEST_ROWS / ROWS_PER_CUTOFF / ROWS_CUTOFF
"""Cutoff of the position filter at least, times the duration: behind it, the rows of a slow motion suffice."""


@dataclass(frozen=True)
class AxisMotion:
    """Motion of an axis.

    Attributes:
        position, velocity, acceleration: (N,) smoothed, for what is nonlinear in them [m or rad, and per s, s²].
        linear: (N, 2) acceleration and velocity of the unfiltered position, to be filtered like the effort.
        effort: (N,) measured, unfiltered [N or Nm].
        sticking: (N,) where the axis may stick: it reverses, or hardly moves.
        moving: (N,) false there, `GUARDS` around it, and at the ends, where filters have not settled.
    """

    position: Array
    velocity: Array
    acceleration: Array
    linear: Array
    effort: Array
    sticking: NDArray[np.bool_]
    moving: NDArray[np.bool_]


def axis_motion(record: AxisRecord, axis: AxisSignals, cutoff: float, bandwidth: float) -> AxisMotion:
    """Motion of an axis by a zero-phase filter of `cutoff` and differences, for rows up to `bandwidth` [rad/s].

    Where an axis reverses it may stick, and friction is then whatever holds it: such rows are left out, with `GUARDS`
    around them.

    Raises:
        EstimationError: the record is too short for the filter, the axis does not move, or its effort never changes.
    """
    dt = record.sample_time
    noise = float(np.std(np.diff(axis.position, 2))) / math.sqrt(6)
    if np.ptp(axis.position) < max(SMALLEST_MOTION, REST * noise):
        raise EstimationError(f"{record.source}: {axis.label} does not move.", "Record it while it is driven.")
    if not np.ptp(axis.effort):
        raise EstimationError(
            f"{record.source}: the effort of {axis.label} never changes.", "Record the force or torque of its drive."
        )
    rows = ROWS_PER_CUTOFF * len(record) * dt * bandwidth / (2 * math.pi)
    if rows < FEWEST_ROWS:
        raise EstimationError(
            f"{record.source} lasts {len(record) * dt:.3g} s and shows the axis up to "
            f"{bandwidth / (2 * math.pi):.3g} Hz: {rows:.0f} independent rows; a diagnosis needs {FEWEST_ROWS:.0f}.",
            "Record longer, or faster where the sampling is why: its frequency must be 20 times what shall be seen.",
        )
    position = smoothed(axis.position, cutoff, dt)
    velocity = differentiate(position, dt, SEVEN)
    speed = float(np.percentile(np.abs(velocity), 95))
    slow = (np.abs(velocity) < STUCK_SPEED * speed) | (np.diff(np.sign(velocity), prepend=np.sign(velocity[0])) != 0)
    moving = _apart(slow, GUARDS[0] / (bandwidth * dt))
    if moving.mean() < AFFORDED:
        moving = _apart(slow, GUARDS[1] / (bandwidth * dt))
    rate = differentiate(axis.position, dt, SEVEN)
    linear = np.stack([differentiate(rate, dt, SEVEN), rate], axis=1)
    return AxisMotion(position, velocity, differentiate(velocity, dt, SEVEN), linear, axis.effort, slow, moving)


def _apart(slow: NDArray[np.bool_], guard: float) -> NDArray[np.bool_]:
    """Samples (N,) further than a guard from slow ones, and twice that from the ends."""
    moving = ~ndimage.binary_dilation(slow, np.ones(2 * round(guard) + 1))
    ends = max(1, round(2 * guard))
    moving[:ends] = moving[-ends:] = False
    return np.asarray(moving, dtype=np.bool_)


def effort_bandwidth(effort: Array, duration: float, limit: float, sample_time: float) -> float:
    """Cutoff for the rows of an axis [rad/s].

    Args:
        effort: (N,) modelled, of which the rows keep EFFORT_SHARE of the power.
        duration: of a repeat, or of the record without any [s]; short ones need a wider band for enough rows.
        limit: that must not be exceeded [rad/s].
        sample_time: [s].
    """
    frequency, power = signal.periodogram(effort, 1 / sample_time, detrend="constant")
    share = np.cumsum(power) / max(float(power.sum()), np.finfo(float).tiny)
    found = float(frequency[min(int(np.searchsorted(share, EFFORT_SHARE)), len(frequency) - 1)])
    wanted = float(np.clip(ROWS_PER_CUTOFF * duration * found, LEAST_ROWS, MOST_ROWS))
    return min(2 * math.pi * wanted / (ROWS_PER_CUTOFF * duration), limit)


def repeat_duration(record: AxisRecord) -> float:
    """Duration of a repeat of a record, or of the whole of it without any [s]."""
    period = with_repeats(record)
    numbers, counts = np.unique(period[period >= 0], return_counts=True)
    return float(counts.min() if len(numbers) >= 2 else len(record)) * record.sample_time


def with_repeats(record: AxisRecord) -> NDArray[np.int64]:
    """Number of the repeat of every sample (N,): as recorded, or found in the positions; -1 throughout without any."""
    if np.unique(record.period[record.period >= 0]).size >= 2:
        return record.period
    length = _repeat_length(np.stack([axis.position for axis in record.axes], axis=1))
    if length is None:
        return np.full(len(record), -1, dtype=np.int64)
    period = np.arange(len(record)) // length
    if len(record) - period[-1] * length < ALMOST_WHOLE * length:
        period[period == period[-1]] = -1
    return np.asarray(period, dtype=np.int64)


def sample_noise(series: Array, sample_time: float) -> float:
    """Deviation of white noise that has the power of a series (N,) in the upper half of its band."""
    return max(math.sqrt(noise_power(series, sample_time) / (2 * sample_time)), np.finfo(float).tiny)


def noise_power(series: Array, sample_time: float) -> float:
    """Power density of what is left of a series (N,) in the upper half of its band, per hertz."""
    length = max(16, len(series) // SPECTRUM_SEGMENTS)
    frequency, power = signal.welch(series, 1 / sample_time, nperseg=min(length, len(series)), detrend="linear")
    return float(np.median(power[len(frequency) // 2 :]))


def _repeat_length(positions: Array) -> int | None:
    """Samples after which all positions (N, n) come back, at least twice; None where they do not."""
    samples = len(positions)
    lags = np.arange(samples // 2 + 1)
    mismatch = np.zeros(len(lags))
    for position in (positions - positions.mean(axis=0)).T:
        spectrum = np.fft.rfft(position, 2 * samples)
        products = np.fft.irfft(np.abs(spectrum) ** 2)[: len(lags)]
        energy = np.concatenate([[0.0], np.cumsum(position**2)])
        pairs = energy[samples - lags] + energy[samples] - energy[lags]
        variance = max(float(np.mean(position**2)), np.finfo(float).tiny)
        mismatch = np.maximum(mismatch, (pairs - 2 * products) / ((samples - lags) * variance))
    left = np.flatnonzero(mismatch > 0.5)
    if not left.size:
        return None
    close = np.flatnonzero(mismatch[left[0] :] < REPEAT_MISMATCH**2) + left[0]
    if not close.size:
        return None
    ends = np.flatnonzero(np.diff(close) > 1)
    first = close[: ends[0] + 1] if ends.size else close
    return int(first[np.argmin(mismatch[first])])

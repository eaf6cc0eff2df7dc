"""What the noise of a measured acceleration looks like: an elastic drive, a law of the load."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import special

from ident.diagnosis.axis.motion import FEWEST_ROWS, LARGEST_ROWS_CUTOFF, noise_power, sample_noise
from ident.diagnosis.observations.rows import ROWS_PER_CUTOFF
from ident.errors import EstimationError
from ident.records.axis_record import AxisRecord, AxisSignals

Array = NDArray[np.float64]

GAINED: Final = 3.0
"""Log evidence that an acceleration without its noise may bring: odds of 20 to 1, at which a name is sure."""


@dataclass(frozen=True)
class AccelerationNoise:
    """What a measured acceleration has of noise, as evidence for what would take it out of the rows.

    While an axis hardly accelerates, what is measured of it is noise, and the best prediction of the effort from that
    is none: what says so looks like an elastic drive, or like a law of the acceleration. To take a noise of power N out
    of rows whose effort has E turns their variance from E + N into E: a log evidence of ln(1 + r), r = N / E, at every
    frequency of a record, as far as it has rows, in the mean. Powers before and after are exponential, and have the
    correlation 1 / (1 + r): the variance of that evidence is 2 r / (1 + r).

    Attributes:
        frequency: (F,) rising [Hz].
        gained: (F,) log evidence up to there, in the mean.
        variance: (F,) of the log evidence up to there.
    """

    frequency: Array
    gained: Array
    variance: Array

    @property
    def limit(self) -> float:
        """Frequency [rad/s] up to which it adds up to `GAINED`."""
        return 2 * math.pi * float(self.frequency[np.searchsorted(self.gained[:-1], GAINED)])

    def within(self, bandwidth: float) -> Array:
        """Mean and variance (2,) of the log evidence in rows of a bandwidth [rad/s].

        White rows show what is below half of their rate, if only as far as the filter leaves something of it.
        """
        shown = ROWS_PER_CUTOFF / 2 * bandwidth / (2 * math.pi)
        return np.array([np.interp(shown, self.frequency, one) for one in (self.gained, self.variance)])


def at_most(noises: Iterable[AccelerationNoise], bandwidth: float) -> float:
    """Log evidence in rows of a bandwidth [rad/s] of some records that one such set of records in twenty exceeds.

    By as many deviations of a Gaussian number as odds of `GAINED` are.
    """
    gained, variance = np.sum([noise.within(bandwidth) for noise in noises], axis=0)
    return float(gained - special.ndtri(math.exp(-GAINED)) * math.sqrt(variance))


def acceleration_noise(
    record: AxisRecord, axis: AxisSignals, inertia: float, left: float, moving: float
) -> AccelerationNoise:
    """Of one axis.

    An effort may hold more than noise where its noise is looked for, and so may what a model leaves: the smaller of the
    two is taken.

    Args:
        record: to which it belongs.
        axis: with its noise.
        inertia: of it [kg or kg m²].
        left: power density of what a first estimate leaves of the effort in the rows [per Hz].
        moving: part of the record that has rows.
    """
    dt = record.sample_time
    position, effort = (noise_power(series, dt) for series in (axis.position, axis.effort))
    frequency = np.fft.rfftfreq(len(record), dt)
    noise = inertia**2 * position * (2 * math.pi * frequency) ** 4
    ratio = noise / max(min(effort, left), np.finfo(float).tiny)
    gained, variance = moving * np.cumsum(np.log1p(ratio)), moving * np.cumsum(2 * ratio / (1 + ratio))
    return AccelerationNoise(np.asarray(frequency, dtype=np.float64), gained, variance)


def noise_limit(record: AxisRecord, axis: AxisSignals, noise: AccelerationNoise, cutoff: float) -> float:
    """Bandwidth [rad/s] of rows in which the noise of the acceleration brings no more than `GAINED` below it.

    No rows are beyond the position's cutoff.

    Args:
        record: to which it belongs.
        axis: one of its axes.
        noise: of that.
        cutoff: of the position filter [rad/s].

    Raises:
        EstimationError: too little is left of a record of its duration.
    """
    dt, duration = record.sample_time, len(record) * record.sample_time
    limit = min(noise.limit, cutoff, LARGEST_ROWS_CUTOFF / dt)
    if ROWS_PER_CUTOFF * limit * duration < 2 * math.pi * FEWEST_ROWS:
        raise EstimationError(
            f"{record.source}: above {limit / (2 * math.pi):.3g} Hz the acceleration of {axis.label}, differences of a "
            f"position with {sample_noise(axis.position, dt):.2g} {axis.kind.position_unit} of noise, is less sure "
            f"than its effort, and {duration:.3g} s of less than that are too few independent rows.",
            "Record longer, or measure the position more finely.",
        )
    return limit

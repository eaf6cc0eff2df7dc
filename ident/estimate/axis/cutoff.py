"""The cutoff of the position filter of an axis, where nobody states one: from the record."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from ident.records.axis_record import AxisRecord

Array = NDArray[np.float64]

LARGEST_CUTOFF: Final = 0.4
"""Of the position filter, over the sampling frequency."""
SPECTRUM_SEGMENTS: Final = 8
BAND: Final = 1.3
"""Ratio of the ends of the bands over which spectra are averaged."""


def position_cutoff(record: AxisRecord, least: float) -> float:
    """Cutoff for the positions of a record [rad/s]: where the noise of their second derivative begins to prevail.

    The power spectrum of the acceleration falls with the motion and rises with the fourth power of the frequency where
    only noise is left; its smoothed minimum lies between, and the smallest over the axes is taken. Below the frequency
    at which the axis is fastest nothing is looked for: a motion without slow parts has little acceleration there too.

    Args:
        record: of any axes.
        least: times the duration: below, nothing but the mean of the motion would be left.
    """
    rate = 1 / record.sample_time
    lowest = min(least / (len(record) * record.sample_time), LARGEST_CUTOFF * rate)
    found = [_quietest(axis.position, rate) for axis in record.axes]
    return 2 * math.pi * float(np.clip(min(found), lowest, LARGEST_CUTOFF * rate))


def _quietest(position: Array, rate: float) -> float:
    acceleration = np.diff(position, 2) * rate**2
    length = max(16, len(acceleration) // SPECTRUM_SEGMENTS)
    frequency, power = signal.welch(acceleration, rate, nperseg=min(length, len(acceleration)), detrend="constant")
    bands = frequency[1 : 1 + max(1, int(len(frequency) / BAND))]
    level = np.array([np.mean(power[(frequency >= low) & (frequency <= BAND * low)]) for low in bands])
    fastest = int(np.argmax(level / bands**2))
    return float(bands[fastest + int(np.argmin(level[fastest:]))])

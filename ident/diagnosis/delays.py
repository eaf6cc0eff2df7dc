"""A series as it was some time before, by its spectrum."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import fft

Array = NDArray[np.float64]

LED_BACK: Final = 1000
"""Samples at least over which a series is led back to its start before its spectrum is turned."""


def delayed(series: Array, delay: float, sample_time: float) -> Array:
    """A series (N,) as it was `delay` seconds before, by its spectrum; its end is led back to its start."""
    length = fft.next_fast_len(len(series) + LED_BACK, real=True)
    closed = np.pad(series, (0, length - len(series)), mode="linear_ramp", end_values=series[0])
    turn = np.exp(-2j * np.pi * fft.rfftfreq(length, sample_time) * delay)
    return np.asarray(fft.irfft(fft.rfft(closed) * turn, length)[: len(series)])

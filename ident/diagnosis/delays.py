"""A series as it was some time before, or before a filter, by its spectrum; and what of a delay is sampling."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import fft

Array = NDArray[np.float64]

LED_BACK: Final = 1000
"""Samples at least over which a series is led back to its start before its spectrum is turned."""

HELD: Final = 0.55
"""Sample intervals up to which a lag is no delay: half of one is what holding a torque over the interval does."""


def delayed(series: Array, delay: float, sample_time: float) -> Array:
    """A series (N,) as it was `delay` seconds before, by its spectrum; its end is led back to its start."""
    return _answered(series, sample_time, lambda angular: np.exp(-1j * angular * delay))


def led(series: Array, time: float, sample_time: float) -> Array:
    """A series (N,) before a filter of first order, as it must have been: u + T u', by its spectrum."""
    return _answered(series, sample_time, lambda angular: 1 + 1j * angular * time)


def _answered(
    series: Array, sample_time: float, response: Callable[[Array], NDArray[np.complexfloating[Any, Any]]]
) -> Array:
    length = fft.next_fast_len(len(series) + LED_BACK, real=True)
    closed = np.pad(series, (0, length - len(series)), mode="linear_ramp", end_values=series[0])
    turn = response(2 * np.pi * fft.rfftfreq(length, sample_time))
    return np.asarray(fft.irfft(fft.rfft(closed) * turn, length)[: len(series)])

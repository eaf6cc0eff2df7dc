"""A series as it was some time before, or before a filter, or behind a spring, by its spectrum; what sampling does."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import fft

Array = NDArray[np.float64]

LED_BACK: Final = 1000
"""Samples at least over which a series is led back to its start before its spectrum is turned."""

DAMPING: Final = 0.05
"""Of what is behind a spring, over the critical damping, tried first: so wide a resonance is met by a few of them."""

RUNG: Final = 7.0
"""Time constants after which what rings behind a spring is a thousandth of what it was."""

RARER: Final = 1.0
"""Log odds of a filter in a drive against a plain delay, which rows of low frequency do not tell from it."""

HELD: Final = 0.55
"""Sample intervals up to which a lag is no delay: half of one is what holding a torque over the interval does."""


def delayed(series: Array, delay: float, sample_time: float) -> Array:
    """A series (N,) as it was `delay` seconds before, by its spectrum; its end is led back to its start."""
    return _answered(series, sample_time, lambda angular: np.exp(-1j * angular * delay))


def led(series: Array, time: float, sample_time: float) -> Array:
    """A series (N,) before a filter of first order, as it must have been: u + T u', by its spectrum."""
    return _answered(series, sample_time, lambda angular: 1 + 1j * angular * time)


def sprung(series: Array, resonance: float, sample_time: float, damping: float = DAMPING) -> Array:
    """Second derivative of a series (N,), with a minus, behind a spring: ω² over 1 - (ω/ω_a)² + 2iζ ω/ω_a.

    Args:
        series: as it is before; what is behind the spring is at rest when it begins.
        resonance: ω_a of what is behind the spring, with the front held [rad/s].
        sample_time: [s].
        damping: ζ, over the critical one.
    """

    ringing = math.ceil(RUNG / (damping * resonance * sample_time))
    return _answered(
        series, sample_time, lambda angular: compliant(angular, resonance, damping), max(ringing, LED_BACK)
    )


def compliant(angular: Array, resonance: float, damping: float) -> NDArray[np.complex128]:
    """What a compliance of one adds to a force on what is behind it, at frequencies (F,), in its unit over the mass.

    Args:
        angular: [rad/s].
        resonance: of what is behind the spring, with the front held [rad/s].
        damping: over the critical one.
    """
    share = angular / resonance
    return np.asarray(angular**2 / (1 - share**2 + 2j * damping * share), dtype=np.complex128)


def _answered(
    series: Array,
    sample_time: float,
    response: Callable[[Array], NDArray[np.complexfloating[Any, Any]]],
    led_back: int = LED_BACK,
) -> Array:
    length = fft.next_fast_len(len(series) + led_back, real=True)
    closed = np.pad(series, (0, length - len(series)), mode="linear_ramp", end_values=series[0])
    turn = response(2 * np.pi * fft.rfftfreq(length, sample_time))
    return np.asarray(fft.irfft(fft.rfft(closed) * turn, length)[: len(series)])

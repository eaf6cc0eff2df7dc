"""Zero-phase filters and derivatives (paper, section 7)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, signal

Array = NDArray[np.float64]

FILTER_ORDER = 2
"""Of the Butterworth prototype; run forwards and backwards. A higher order rings longer than `guard`."""


@dataclass(frozen=True)
class Processing:
    """How signals become equations.

    Attributes:
        cutoff: ω_g of the zero-phase filter on every column of Θ and on τ [rad/s]; paper: 40.
        signal_cutoff: of the zero-phase filter on positions before they are differentiated [rad/s]. Well above
            `cutoff`, so that tanh sees the velocity and not a smoothed one.
        moving: joint rates below this are taken as stiction, their rows dropped [rad/s].
        guard: rows this close to a dropped one are dropped too [s]: the filter's memory, several 1/ω_g.
    """

    cutoff: float = 40.0
    signal_cutoff: float = 500.0
    moving: float = 0.05
    guard: float = 0.1


def zero_phase(values: Array, cutoff: float, sample_time: float) -> Array:
    """Butterworth low-pass forwards and backwards along axis 0, cutoff in rad/s."""
    return np.asarray(signal.sosfiltfilt(_sections(cutoff, sample_time), values, axis=0))


@lru_cache(maxsize=32)
def _sections(cutoff: float, sample_time: float) -> Array:
    return np.asarray(signal.butter(FILTER_ORDER, cutoff / (2 * math.pi), fs=1 / sample_time, output="sos"))


def differentiate(values: Array, sample_time: float) -> Array:
    """Central differences along axis 0."""
    return np.asarray(np.gradient(values, sample_time, axis=0))


def second_derivative(values: Array, sample_time: float) -> Array:
    """Three-point second differences along axis 0; the ends repeat their neighbours."""
    inner = (values[2:] - 2 * values[1:-1] + values[:-2]) / sample_time**2
    return np.concatenate([inner[:1], inner, inner[-1:]])


def moving_rows(rates: Array, processing: Processing, sample_time: float) -> NDArray[np.bool_]:
    """Rows in which every joint of `rates` (N, n) moves, and has moved for the filter's memory."""
    moving = np.all(np.abs(rates) > processing.moving, axis=1)
    width = 2 * round(processing.guard / sample_time) + 1
    return np.asarray(ndimage.binary_erosion(moving, np.ones(width, dtype=bool), border_value=0))

"""Zero-phase filters and derivatives (paper, section 7)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, signal

from ident.errors import EstimationError

Array = NDArray[np.float64]

FILTER_ORDER: Final = 2
"""Of the Butterworth prototype; run forwards and backwards. A higher order rings longer than `guard`."""

_BEYOND: Final = 3 * (FILTER_ORDER + 1)
"""Samples by which a record is continued beyond its ends, where the filter begins: what scipy takes by itself."""


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


def zero_phase(values: Array, cutoff: float, sample_time: float, unjudged: int = 0) -> Array:
    """Butterworth low-pass forwards and backwards along axis 0, cutoff in rad/s.

    Beyond its ends a signal is continued by its reflection in a point. Were that the end sample of a record, an error
    of that one sample would count twice in all that lies beyond; so it is the first that has been judged.

    Args:
        values: (N, ...).
        cutoff: [rad/s].
        sample_time: [s].
        unjudged: samples at each end that are continued too, as what is measured there may be an error.

    Raises:
        EstimationError: the samples are too far apart for the cutoff.
    """
    if cutoff * sample_time >= math.pi:
        raise EstimationError(
            f"The samples are {sample_time:.4g} s apart, too far for a filter at {cutoff:g} rad/s.",
            f"Give time in seconds, and record at {math.ceil(cutoff / math.pi / 10) * 10 + 10} Hz or more.",
        )
    judged = np.asarray(values, dtype=float)[unjudged : len(values) - unjudged]
    sides = [(unjudged + _BEYOND, unjudged + _BEYOND)] + [(0, 0)] * (judged.ndim - 1)
    continued = np.pad(judged, sides, mode="reflect", reflect_type="odd")
    filtered = signal.sosfiltfilt(_sections(cutoff, sample_time), continued, axis=0, padtype=None)
    return np.asarray(filtered[_BEYOND:-_BEYOND])


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
    return _away_from_rest(rates, processing.moving, processing.guard, sample_time)


def sliding_samples(rates: Array, processing: Processing, sample_time: float) -> NDArray[np.bool_]:
    """Samples in which every joint of `rates` (N, n) slides, before any filter of `cutoff`.

    The rates themselves come from positions filtered at `signal_cutoff`; that filter forgets as much sooner as it is
    faster.
    """
    memory = processing.guard * processing.cutoff / processing.signal_cutoff
    return _away_from_rest(rates, processing.moving, memory, sample_time)


def _away_from_rest(rates: Array, slow: float, memory: float, sample_time: float) -> NDArray[np.bool_]:
    moving = np.all(np.abs(rates) > slow, axis=1)
    width = 2 * round(memory / sample_time) + 1
    return np.asarray(ndimage.binary_erosion(moving, np.ones(width, dtype=bool), border_value=0))

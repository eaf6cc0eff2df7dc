"""Zero-phase filters and derivatives (paper, section 7): how a record becomes angles, rates and accelerations."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import fft, ndimage, signal, sparse

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
    of that one sample would count twice in all that lies beyond; so it is the first that has been checked.

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
    forwards = _settled(continued, cutoff, sample_time)
    return np.asarray(_settled(forwards[::-1], cutoff, sample_time)[::-1][_BEYOND:-_BEYOND])


def _settled(values: Array, cutoff: float, sample_time: float) -> Array:
    """One pass of the filter, which has seen the first sample (1, ...) for ever."""
    states = _states(cutoff, sample_time)
    begun = states.reshape(*states.shape, *[1] * (values.ndim - 1)) * values[:1]
    filtered, _ = signal.sosfilt(butterworth(FILTER_ORDER, cutoff, sample_time), values, axis=0, zi=begun)
    return np.asarray(filtered)


@lru_cache(maxsize=32)
def butterworth(order: int, cutoff: float, sample_time: float) -> Array:
    """Second-order sections (k, 6) of a low-pass, cutoff in rad/s; one array for all who ask, to be read only."""
    return np.asarray(signal.butter(order, cutoff / (2 * math.pi), fs=1 / sample_time, output="sos"))


@lru_cache(maxsize=32)
def _states(cutoff: float, sample_time: float) -> Array:
    """States (k, 2) of its sections under a one that has lasted; as for `butterworth`."""
    return np.asarray(signal.sosfilt_zi(butterworth(FILTER_ORDER, cutoff, sample_time)))


MEMORY: Final = 50.0
"""Time constants over which a series is mirrored: of a wave at the cutoff e^-19 is left of what lies beyond them."""


def mirrored(values: Array, passes: Sequence[tuple[int, float]], sample_time: float) -> Array:
    """Butterworth low-passes, each forwards and backwards, along axis 0, for the terms of an equation.

    Beyond its ends a term goes on as in a mirror, where the equation holds as it does inside. A reflection in the end
    sample, right for the positions of a motion that goes on, would make the noise of that one sample twice as large and
    let it last: that of an acceleration, differences twice over, is a thousand times what rows behind the filter show.

    What is mirrored stays so behind a filter of zero phase: all of them at once are one gain of its spectrum.

    Args:
        values: (N, ...).
        passes: order of the prototype and cutoff [rad/s] of each.
        sample_time: [s].
    """
    values = np.asarray(values, dtype=float)
    count, reach = len(values), max(math.ceil(MEMORY / (cutoff * sample_time)) for _, cutoff in passes)
    size = fft.next_fast_len(count + 2 * reach, real=True)
    sides = [(reach, size - count - reach)] + [(0, 0)] * (values.ndim - 1)
    spectrum = fft.rfft(np.pad(values, sides, mode="reflect"), axis=0)
    spectrum *= _gain(tuple(passes), sample_time, size).reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray(fft.irfft(spectrum, size, axis=0)[reach : reach + count])


@lru_cache(maxsize=32)
def _gain(passes: tuple[tuple[int, float], ...], sample_time: float, size: int) -> Array:
    """(size // 2 + 1,) of Butterworth filters forwards and backwards, bilinear, at the frequencies of a real transform.

    One array for all who ask, to be read only.
    """
    tangent = np.tan(np.pi * np.arange(size // 2 + 1) / size)
    gain = np.ones_like(tangent)
    for order, cutoff in passes:
        gain /= 1 + (tangent / math.tan(cutoff * sample_time / 2)) ** (2 * order)
    gain.setflags(write=False)
    return gain


def filter_weights(
    gain: Callable[[Array], Array], memory: float, moments: Array, count: int, sample_time: float
) -> Any:
    """(n, count) sparse, that makes of a series what a zero-phase filter would have at some moments.

    Cheaper than the filter where few moments of many series are wanted. Beyond its ends a series is mirrored once: what
    lies further away than its length counts as zero.

    Args:
        gain: of the filter at angular frequencies (F,) [rad/s].
        memory: after which it has forgotten a sample [s].
        moments: (n,) from the beginning of the first sample, which lasts `sample_time` [s].
        count: samples of the series, at least one.
        sample_time: [s].
    """
    reach = math.ceil(memory / sample_time)
    place = np.rint(moments / sample_time - 0.5).astype(np.int64)
    length = fft.next_fast_len(2 * (reach + 2), real=True)
    frequency = 2 * np.pi * np.fft.rfftfreq(length, sample_time)
    # Moments lie between the samples of the series, each by its own part of an interval.
    late = moments - (place + 0.5) * sample_time
    responses = np.fft.irfft(
        gain(np.asarray(frequency, dtype=np.float64)) * np.exp(-1j * np.multiply.outer(late, frequency)), length, axis=1
    )
    offsets = np.arange(-reach, reach + 1)
    columns = place[:, None] + offsets
    columns = np.where(columns < 0, -1 - columns, columns)
    columns = np.where(columns >= count, 2 * count - 1 - columns, columns)
    rows = np.repeat(np.arange(len(moments)), len(offsets))
    inside = (columns >= 0) & (columns < count)
    values = np.where(inside, responses[:, offsets], 0.0)
    return sparse.csr_matrix(
        (values.ravel(), (rows, np.where(inside, columns, 0).ravel())), shape=(len(moments), count)
    )


THREE: Final = 3
SEVEN: Final = 7
"""Samples that a central difference is taken from.

Those of three, of second order, are the estimate's: its rows end at 40 rad/s. They lose a sixth of (ω T)² of a rate,
twice for an acceleration: as much as an elastic drive would. At 500 Hz that is 8 % of the acceleration of a motor that
rings at 490 rad/s on its gear. Those of seven, of sixth order, lose 0.1 % of it; they are the diagnosis', which looks
for such drives.
"""

_FIRST: Final = np.array([-1, 9, -45, 0, 45, -9, 1]) / 60
_SECOND: Final = np.array([2, -27, 270, -490, 270, -27, 2]) / 180
"""Weights of seven neighbours."""


def differentiate(values: Array, sample_time: float, samples: int = THREE) -> Array:
    """First derivative along axis 0 by central differences; of three samples at the ends, of two at the last."""
    found = np.asarray(np.gradient(values, sample_time, axis=0))
    return found if samples == THREE else _refined(found, values, _FIRST, sample_time)


def second_derivative(values: Array, sample_time: float, samples: int = THREE) -> Array:
    """Second derivative along axis 0 by central differences; of three samples at the ends, the last repeat theirs."""
    inner = (values[2:] - 2 * values[1:-1] + values[:-2]) / sample_time**2
    found = np.concatenate([inner[:1], inner, inner[-1:]])
    return found if samples == THREE else _refined(found, values, _SECOND, sample_time**2)


def _refined(found: Array, values: Array, weights: Array, unit: float) -> Array:
    """A derivative, taken anew wherever all the neighbours are there."""
    reach = len(weights) // 2
    inner = slice(reach, len(found) - reach)
    found[inner] = ndimage.correlate1d(values, weights, axis=0)[inner] / unit
    return found


@dataclass(frozen=True)
class Smoothed:
    """Measured angles of some joints, smoothed, with their derivatives.

    Attributes:
        angles, rates, accelerations: (N, n) [rad, rad/s, rad/s²].
    """

    angles: Array
    rates: Array
    accelerations: Array


def smooth(
    angles: Array, processing: Processing, sample_time: float, samples: int = THREE, unjudged: int = 0
) -> Smoothed:
    """Angles below `signal_cutoff`, and their derivatives: the one way from a record to motion.

    Args:
        angles: (N, n) as measured [rad].
        processing: the filter.
        sample_time: [s].
        samples: that the derivatives are taken from, THREE or SEVEN.
        unjudged: samples at each end that `zero_phase` continues. The estimate distrusts those that no neighbour has
            checked; the diagnosis takes all, and uses no row that is so near to an end.
    """
    smoothed = zero_phase(angles, processing.signal_cutoff, sample_time, unjudged)
    rates = differentiate(smoothed, sample_time, samples)
    return Smoothed(smoothed, rates, second_derivative(smoothed, sample_time, samples))


SETTLED: Final = 100
"""Samples after which nothing is left of an impulse behind the filter of the signals."""


def moving_rows(rates: Array, processing: Processing, sample_time: float) -> NDArray[np.bool_]:
    """Rows in which every joint of `rates` (N, n) moves, and has moved for the filter's memory."""
    return _away_from_rest(rates, processing.moving, processing.guard, sample_time)


def away_from_ends(rows: NDArray[np.bool_], processing: Processing, sample_time: float) -> NDArray[np.bool_]:
    """Those of some rows (N, ...) that the filter's memory keeps from the ends of a record."""
    ends, found = round(processing.guard / sample_time), rows.copy()
    found[:ends] = found[len(found) - ends :] = False
    return found


def sliding_samples(rates: Array, processing: Processing, sample_time: float, slowest: ArrayLike) -> NDArray[np.bool_]:
    """Samples in which every joint of `rates` (N, n) slides, before any filter of `cutoff`.

    The rates themselves come from positions filtered at `signal_cutoff`; that filter forgets as much sooner as it is
    faster.

    Args:
        rates: (N, n) [rad/s].
        processing: filters.
        sample_time: [s].
        slowest: rate from which a joint slides, one or (n,) [rad/s].
    """
    memory = processing.guard * processing.cutoff / processing.signal_cutoff
    return _away_from_rest(rates, slowest, memory, sample_time)


def rate_noise(angles: Array, processing: Processing, sample_time: float, samples: int = THREE) -> Array:
    """Standard deviation (n,) of the rates that `smooth` makes of measured angles (N, n) [rad/s].

    What white noise is of angles shows in their fourth differences, where motion has died away.
    """
    impulse = np.zeros((2 * SETTLED + 1, 1))
    impulse[SETTLED] = 1.0
    gain = np.linalg.norm(smooth(impulse, processing, sample_time, samples).rates)
    return np.asarray(gain * np.std(np.diff(angles, 4, axis=0), axis=0) / math.sqrt(math.comb(8, 4)))


def _away_from_rest(rates: Array, slow: ArrayLike, memory: float, sample_time: float) -> NDArray[np.bool_]:
    moving = np.all(np.abs(rates) > slow, axis=1)
    # A joint may turn round between two samples, slow in neither.
    turns = np.flatnonzero(np.any(np.diff(rates > 0, axis=0), axis=1))
    moving[turns] = moving[turns + 1] = False
    width = 2 * round(memory / sample_time) + 1
    return np.asarray(ndimage.binary_erosion(moving, np.ones(width, dtype=bool), border_value=0))

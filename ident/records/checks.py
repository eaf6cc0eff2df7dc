"""Checks that every record passes: finite values, uniform time."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ident.errors import RecordError

Array = NDArray[np.float64]

UNIFORMITY: Final = 0.02
"""Largest deviation of a sample interval from the median one, as a fraction of it."""

SHORTEST: Final = 10
"""Samples that a record, or a step of it, must have."""

ALONE: Final = 16.0
"""Distance of a single sample from its neighbours, in the largest of 95 % of such distances, from which it is refused.

White noise of a million samples reaches 2.6, and steps of force or speed are no single samples, however large.
"""
UNJUDGED: Final = 3
"""Samples at each end that have too few neighbours to be checked against; nothing may depend on one of them alone."""
_ENOUGH: Final = 100
"""Samples without which nothing is usual."""
_NEAR: Final = 12
"""Samples on each side among which a lone sample must have no equal."""
_FIT: Final = np.array([-3.0, -2.0, -1.0, 1.0, 2.0, 3.0])
"""Samples around a lone one through which a parabola goes."""
_STRAY: Final = 0.15
"""Largest distance from that parabola, in that of the lone sample: 0.19 at a kink of the motion, 0.57 at a step."""


def refuse_short(samples: int, where: str) -> None:
    """Refuse what is too short to be anything.

    Raises:
        RecordError: fewer than SHORTEST samples.
    """
    if samples < SHORTEST:
        raise RecordError(f"{where} holds {samples} samples.", f"It needs at least {SHORTEST}.")


def numbers(name: str, channel: NDArray[Any], where: str) -> Array:
    """A channel (N,) as numbers.

    Raises:
        RecordError: it holds something else; with the first such sample.
    """
    try:
        return np.asarray(channel, dtype=float)
    except (TypeError, ValueError) as error:
        first = next(index for index, value in enumerate(channel) if not _is_number(value))
        raise RecordError(
            f"{where}: channel {name} holds {str(channel[first])!r} at sample {first}, which is no number.",
            "Write numbers with a decimal point.",
        ) from error


def holds_numbers(channel: NDArray[Any]) -> bool:
    """Whether a channel that nobody needs could be carried along as numbers."""
    try:
        np.asarray(channel, dtype=float)
    except (TypeError, ValueError):
        return False
    return True


def _is_number(value: Any) -> bool:
    return holds_numbers(np.array([value]))


def refuse_nonfinite(name: str, values: Array, where: str) -> None:
    """Refuse NaN and infinity in one channel (N,).

    Raises:
        RecordError: with the channel, the number of such samples and the first of them.
    """
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        raise RecordError(
            f"{where}: channel {name} has {bad.size} samples that are not numbers, the first at sample {bad[0]} "
            "(lost_samples).",
            "Cut that part out, or record it again.",
        )


def refuse_lone_samples(name: str, values: Array, where: str) -> None:
    """Refuse a sample that leaves its channel (N,) and is back with the next one, as a damaged one does.

    No mass moves like that, and no force does that once only: a step of force or speed changes what comes after it,
    and noise, vibration and impacts have more samples of that kind around them or elsewhere. The first three and the
    last three samples have too few neighbours; they are refused outside of what the channel takes elsewhere, by more
    than its whole range. Of less than 100 samples nothing is refused.

    Raises:
        RecordError: with the channel and the sample.
    """
    if len(values) < _ENOUGH:
        return
    _refuse_ends_outside(name, values, where)
    off = _off_neighbours(values)
    usual = float(np.quantile(np.abs(off), 0.95)) or _smallest_move(values)
    for sample in (np.flatnonzero(np.abs(off) > ALONE * usual) + UNJUDGED).tolist():
        if _is_largest_near(off, sample - UNJUDGED) and _is_alone(values, sample):
            raise _lone_sample(name, values, sample, where)


def _lone_sample(name: str, values: Array, sample: int, where: str) -> RecordError:
    around = [values[near] for near in (sample - 1, sample + 1) if 0 <= near < len(values)]
    return RecordError(
        f"{where}: channel {name} at sample {sample} is {values[sample]:g}, beside "
        f"{' and '.join(f'{value:g}' for value in around)}: that is no motion.",
        "It was damaged, in the file or in the sensor: cut that part out, or record again.",
    )


def _refuse_ends_outside(name: str, values: Array, where: str) -> None:
    # Zero belongs to it: a record may begin before anything is asked for.
    inner = values[UNJUDGED:-UNJUDGED]
    low, high = float(np.min(inner, initial=0.0)), float(np.max(inner, initial=0.0))
    for sample in (*range(UNJUDGED), *range(len(values) - UNJUDGED, len(values))):
        if max(low - values[sample], values[sample] - high) > high - low > 0:
            raise _lone_sample(name, values, sample, where)


def _smallest_move(values: Array) -> float:
    """The resolution of a channel that mostly rests, infinite where it always does."""
    moves = np.abs(np.diff(values))
    return float(np.min(moves[moves > 0], initial=np.inf))


def _off_neighbours(values: Array) -> Array:
    """Distance (N - 6,) of samples 3 to N - 4 from the cubic through the two before and the two behind them."""
    around = -values[1:-5] + 4.0 * values[2:-4] + 4.0 * values[4:-2] - values[5:-1]
    distance: Array = values[3:-3] - around / 6.0
    return distance


def _is_alone(values: Array, sample: int) -> bool:
    """Whether the samples around one lie on a parabola that passes it by."""
    around = values[sample + _FIT.astype(int)]
    terms = np.vander(_FIT, 3)
    parabola = np.linalg.lstsq(terms, around, rcond=None)[0]
    return bool(np.max(np.abs(around - terms @ parabola)) <= _STRAY * abs(values[sample] - parabola[-1]))


def _is_largest_near(off: Array, row: int) -> bool:
    """Whether no other distance near one is of its size; it has itself two on each side that are."""
    near = np.concatenate([off[max(row - _NEAR, 0) : max(row - 2, 0)], off[row + 3 : row + 3 + _NEAR]])
    return bool(np.max(np.abs(near), initial=0.0) <= abs(off[row]) / 4.0)


def period_numbers(channel: NDArray[Any] | None, samples: int, where: str) -> NDArray[np.int64]:
    """The optional channel `period` as whole numbers (samples,), -1 throughout where there is none.

    Raises:
        RecordError: a value is no whole number, or no number at all.
    """
    period = np.full(samples, -1.0) if channel is None else numbers("period", channel, where)
    if not np.all(np.isfinite(period) & (period == np.round(period))):
        raise RecordError(
            f"{where}: channel period holds values that are no whole numbers.",
            "Number the repeats 0, 1, 2 ... and write -1 outside of them, or leave the channel out.",
        )
    return period.astype(np.int64)


def uniform_sample_time(time: Array, where: str) -> float:
    """Mean sample interval of a uniform time channel (N,) [s].

    Raises:
        RecordError: time does not increase, or an interval differs from the usual one by more than UNIFORMITY.
    """
    intervals = np.diff(time)
    sample_time = float(np.median(intervals))
    if sample_time <= 0:
        raise RecordError(f"{where}: time does not increase.", "Give time in seconds, increasing.")
    worst = int(np.argmax(np.abs(intervals - sample_time)))
    if abs(intervals[worst] - sample_time) > UNIFORMITY * sample_time:
        missing = round(float(np.sum(np.maximum(np.round(intervals / sample_time) - 1, 0))))
        fault = f"lost_samples: {missing} are missing" if missing else "unsynchronised: the clock jitters"
        raise RecordError(
            f"{where}: time is not uniform: {intervals[worst] * 1e3:.3f} ms after t = {time[worst]:.4f} s "
            f"where {sample_time * 1e3:.3f} ms are usual ({fault}).",
            "Resample the record, or cut it at the gap; the steps of a vehicle record may also be given other names "
            "on its two sides.",
        )
    return float((time[-1] - time[0]) / (len(time) - 1))

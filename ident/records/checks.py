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
            f"{where}: channel {name} has {bad.size} samples that are not numbers, the first at sample {bad[0]}.",
            "Cut that part out, or record it again.",
        )


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
        raise RecordError(
            f"{where}: time is not uniform: {intervals[worst] * 1e3:.3f} ms after t = {time[worst]:.4f} s "
            f"where {sample_time * 1e3:.3f} ms are usual.",
            "Resample the record, or cut it at the gap; the steps of a vehicle record may also be given other names "
            "on its two sides.",
        )
    return float((time[-1] - time[0]) / (len(time) - 1))

"""The SYNCs of a log on the grid of the cycle period."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ident.errors import RecordError
from ident.records.checks import UNIFORMITY

FloatArray = NDArray[np.float64]

_JITTER_TOLERANCE = 0.1
"""Share of the period by which SYNCs may wander before the samples are interpolated.

Below it, stamps say less about the instant of sampling than the grid does: a frame that was on the bus delays the SYNC
by up to 135 bit times, and stamps of an interface are not better than that either.
"""

_LATE = 0.95
"""Lateness of a SYNC, in periods, up to which nothing counts as left out; the master leaves out from 1 on."""

_AROUND = 4
"""Cycles on each side of an interval that tell phase and speed."""

_CLEARLY = 4.0
"""How many times its own doubt the motion within a shift must have to be a witness."""


class SyncGrid:
    """Instants of SYNCs, and samples taken at them, on a uniform grid.

    Args:
        stamps: (M,) instants of the SYNCs [s].
        period: of the grid [s].
        longest_gap: cycles in a row that may have been left out.
        where: the log, for messages.

    Attributes:
        time: (N,) the grid, from 0 [s]; N is at most M times longest_gap + 2.
        missing: cycles without a SYNC.
        jitter: largest deviation between two SYNCs from the period, missing cycles aside [s].
        resamples: the samples have to be interpolated.
        nearest: (N,) number of the SYNC that each instant is the nearest of, -1 where there is none: a cycle left out.

    Raises:
        RecordError: a stamp is not later than the one before it, more cycles in a row are missing, or the SYNCs come
            at another period.
    """

    def __init__(self, stamps: FloatArray, period: float, longest_gap: int, where: str) -> None:
        self._elapsed = stamps - stamps[0]
        _refuse_steps_back(self._elapsed, where)
        _refuse_other_period(self._elapsed, period, where)
        steps = np.diff(self._elapsed) / period
        # A SYNC may be late by most of a period without another one having been left out.
        left_out = np.maximum(np.ceil(steps - 1.0 - _LATE), 0.0)
        # Before the grid is made: what lies between two stamps may be years of a clock that was set.
        _refuse_long_gaps(left_out, self._elapsed, longest_gap, where)
        deviation = np.abs(steps - 1.0 - left_out)
        self.jitter = float(deviation.max(initial=0.0)) * period
        count = int(np.rint(self._elapsed[-1] / period)) + 1
        self.missing = int(left_out.sum())
        self.resamples = count != len(stamps) or self.jitter > _JITTER_TOLERANCE * period
        self.time = np.multiply(np.arange(count if self.resamples else len(stamps)), period, dtype=np.float64)
        self.nearest = self._nearest()

    def _nearest(self) -> NDArray[np.int64]:
        numbers = np.arange(len(self._elapsed))
        if not self.resamples:
            return numbers
        nearest = np.rint(np.interp(self.time, self._elapsed, numbers)).astype(np.int64)
        # Of the instants around a gap that have the same SYNC nearest to them, it belongs to the nearest.
        closest_first = np.lexsort((np.abs(self.time - self._elapsed[nearest]), nearest))
        _, first = np.unique(nearest[closest_first], return_index=True)
        own = np.full_like(nearest, -1)
        own[closest_first[first]] = nearest[closest_first[first]]
        return own

    def refuse_clock_steps(self, angles: FloatArray, resolution: FloatArray, period: float, where: str) -> None:
        """Refuse a clock that was set by less than a gap, which the stamps alone cannot tell from a late SYNC.

        Where the phase of the SYNCs changes for good, the motion tells how much time has really passed: an axis that
        turns goes on by its speed times that. Where nothing turns nothing is interpolated wrongly either.

        Args:
            angles: (M, K) measured at the SYNCs [rad].
            resolution: (K,) of them [rad].
            period: of the grid [s].
            where: the log, for messages.

        Raises:
            RecordError: the angles went on for one cycle where the clock says otherwise; says when.
        """
        for row in _lasting_shifts(self._elapsed, period):
            if _only_a_cycle_passed(self._elapsed, angles, resolution, row, period):
                shift = self._elapsed[row + 1] - self._elapsed[row] - period
                raise RecordError(
                    f"{where}: the clock of the log was set by {shift * 1e3:+.3f} ms after "
                    f"t = {self._elapsed[row]:.3f} s, while the wheels went on for one cycle.",
                    "Drive the step again, without anything that sets the recorder's clock meanwhile (NTP).",
                )

    def interpolate(self, values: FloatArray) -> FloatArray:
        """Measured columns (M, K) on the grid (N, K)."""
        if not self.resamples:
            return values
        columns = [np.interp(self.time, self._elapsed, column) for column in values.T]
        return np.stack(columns, axis=1)

    def hold(self, values: FloatArray) -> FloatArray:
        """Commanded columns (M, K) on the grid (N, K): each holds until the next SYNC."""
        if not self.resamples:
            return values
        rows = np.searchsorted(self._elapsed, self.time + 1e-9, side="right") - 1
        held: FloatArray = values[rows]
        return held


def _refuse_steps_back(elapsed: FloatArray, where: str) -> None:
    back = np.flatnonzero(np.diff(elapsed) <= 0)
    if back.size:
        step = elapsed[back[0] + 1] - elapsed[back[0]]
        raise RecordError(
            f"{where}: the clock of the log steps by {step:.6f} s from one SYNC to the next, "
            f"after t = {elapsed[back[0]]:.3f} s.",
            "Cut the log there, or drive the step again; blocks of the file may be in the wrong order, too.",
        )


def _refuse_other_period(elapsed: FloatArray, period: float, where: str) -> None:
    usual = float(np.median(np.diff(elapsed))) if len(elapsed) > 1 else period
    if abs(usual - period) > UNIFORMITY * period:
        raise RecordError(
            f"{where}: SYNCs come every {usual * 1e3:.3f} ms, and the network file says {period * 1e3:.3f} ms.",
            "Decode it with the network file that it was recorded with.",
        )


def _refuse_long_gaps(left_out: FloatArray, elapsed: FloatArray, longest: int, where: str) -> None:
    if left_out.max(initial=0.0) > longest:
        row = int(left_out.argmax())
        raise RecordError(
            f"{where}: {left_out[row]:.0f} cycles in a row are missing after t = {elapsed[row]:.3f} s.",
            "Drive the step again; see to it that the master keeps its cycle and nothing sets the recorder's clock.",
        )


def _lasting_shifts(elapsed: FloatArray, period: float) -> list[int]:
    """Rows after which the SYNCs keep the phase that one odd interval has given them."""
    odd = np.diff(elapsed) - period
    phase = elapsed - period * np.arange(len(elapsed))
    rows = np.flatnonzero(np.abs(odd) > _JITTER_TOLERANCE * period)
    return [row for row in rows.tolist() if abs(_shift(phase, row) - odd[row]) < _JITTER_TOLERANCE * period]


def _shift(phase: FloatArray, row: int) -> float:
    before, after = phase[max(row + 1 - _AROUND, 0) : row + 1], phase[row + 1 : row + 1 + _AROUND]
    return float(np.median(after) - np.median(before))


def _only_a_cycle_passed(
    elapsed: FloatArray, angles: FloatArray, resolution: FloatArray, row: int, period: float
) -> bool:
    """Whether the angles around an interval fit one cycle better than the time that the stamps tell."""
    first, last = max(row - _AROUND, 0), min(row + 1 + _AROUND, len(elapsed) - 1)
    if first == row or last == row + 1:
        return False
    before = (angles[row] - angles[first]) / (period * (row - first))
    after = (angles[last] - angles[row + 1]) / (period * (last - row - 1))
    speed, doubt = (before + after) / 2, np.abs(after - before) / 2
    stamped, gone = elapsed[row + 1] - elapsed[row], angles[row + 1] - angles[row]
    told = np.abs(speed * (stamped - period))
    tells = told > _CLEARLY * (doubt * max(stamped, period) + resolution)
    by_stamps, by_cycle = np.abs(gone - speed * stamped)[tells], np.abs(gone - speed * period)[tells]
    return bool(by_cycle.sum() < by_stamps.sum())

"""The SYNCs of a log on the grid of the cycle period."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_JITTER_TOLERANCE = 0.1
"""Share of the period by which SYNCs may wander before the samples are interpolated.

Below it, stamps say less about the instant of sampling than the grid does: a frame that was on the bus delays the SYNC
by up to 135 bit times, and stamps of an interface are not better than that either.
"""

_LATE = 0.95
"""Lateness of a SYNC, in periods, up to which nothing counts as left out; the master leaves out from 1 on."""


class SyncGrid:
    """Instants of SYNCs, and samples taken at them, on a uniform grid.

    Args:
        stamps: (M,) instants of the SYNCs [s], ascending.
        period: of the grid [s].

    Attributes:
        time: (N,) the grid, from 0 [s].
        missing: cycles without a SYNC.
        worst_gap: most cycles missing in a row.
        worst_gap_at: where that is, from the first SYNC [s].
        jitter: largest deviation between two SYNCs from the period, missing cycles aside [s].
        resamples: the samples have to be interpolated.
    """

    def __init__(self, stamps: FloatArray, period: float) -> None:
        self._elapsed = stamps - stamps[0]
        steps = np.diff(self._elapsed) / period
        # A SYNC may be late by most of a period without another one having been left out.
        left_out = np.maximum(np.ceil(steps - 1.0 - _LATE), 0.0)
        deviation = np.abs(steps - 1.0 - left_out)
        self.worst_gap = int(left_out.max(initial=0.0))
        self.worst_gap_at = float(self._elapsed[left_out.argmax()]) if len(left_out) else 0.0
        self.jitter = float(deviation.max(initial=0.0)) * period
        count = int(np.rint(self._elapsed[-1] / period)) + 1
        self.missing = int(left_out.sum())
        self.resamples = count != len(stamps) or self.jitter > _JITTER_TOLERANCE * period
        self.time = np.multiply(np.arange(count if self.resamples else len(stamps)), period, dtype=np.float64)

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

"""Time of a log whose SYNCs moved the other side's time: simulated, whatever the wall clock did meanwhile."""

from __future__ import annotations

import can


class SyncTime:
    """Stamps of frames by the SYNCs that a master has sent.

    A master in lockstep sends SYNCs as fast as the other side answers, so wall time says nothing of the instants of
    its samples. Frames between two SYNCs bear the instant of the first. Before the first SYNC of all, wall time holds.

    Args:
        sync_cob_id: identifier of the SYNC.
        period: by which each SYNC moves time [s].
    """

    def __init__(self, sync_cob_id: int, period: float) -> None:
        self._sync = sync_cob_id
        self._period = period
        self._start: float | None = None
        self._count = 0

    def __call__(self, message: can.Message) -> float:
        """The stamp of a frame, frames in the order in which they were on the bus [s]."""
        if message.arbitration_id == self._sync and not message.is_extended_id:
            if self._start is None:
                self._start = float(message.timestamp)
            else:
                self._count += 1
        if self._start is None:
            return float(message.timestamp)
        return self._start + self._count * self._period

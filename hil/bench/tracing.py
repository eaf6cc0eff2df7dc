"""Server and clock that leave stamps on their way, so that one can see afterwards where a cycle lost its time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import can

from hil.bench.serving import Port, VehicleServer
from hil.bus.clock import WallClock
from hil.bus.stamps import Moment, Stamps


class TracedServer(VehicleServer):
    """A server whose turns are stamped.

    Args:
        stamps: where.
        server: everything that a `VehicleServer` takes.
    """

    def __init__(self, stamps: Stamps, *server: Any, **named: Any) -> None:
        super().__init__(*server, **named)
        self._stamps = stamps
        self._port = _TracedPort(self._port, stamps, self._sync_cob_id)

    def _move(self) -> None:
        super()._move()
        self._stamps.stamp(Moment.MOVED)


class _TracedPort:
    """A port that knows when its owner waits."""

    def __init__(self, port: Port, stamps: Stamps, sync_cob_id: int) -> None:
        self._port = port
        self._stamps = stamps
        self._sync_cob_id = sync_cob_id
        self.send_data = port.send_data
        self.burst = port.burst

    def take(self, timeout: float) -> tuple[int, bytes] | None:
        stamp = self._stamps.stamp
        stamp(Moment.LISTENS)
        frame = self._port.take(timeout)
        stamp(Moment.SYNC_TAKEN if frame is not None and frame[0] == self._sync_cob_id else Moment.ROUSED)
        return frame


class TracedClock(WallClock):
    """A clock of a master that leaves stamps around each wait."""

    def __init__(self, stamps: Stamps) -> None:
        super().__init__()
        self._stamps = stamps

    def wait_until(self, instant: float) -> float:
        """See `WallClock`."""
        self._stamps.stamp_due(instant - self._origin)
        self._stamps.stamp(Moment.RESTS)
        lateness = super().wait_until(instant)
        self._stamps.stamp(Moment.AWAKE)
        return lateness


def tap_of_sync(stamps: Stamps, sync_cob_id: int) -> Callable[[can.Message], None]:
    """A tap for a master that stamps when it has sent a SYNC."""

    def tap(message: can.Message) -> None:
        if message.arbitration_id == sync_cob_id and not message.is_rx:
            stamps.stamp(Moment.SYNC_SENT)

    return tap

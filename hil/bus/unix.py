"""A lossless CAN bus between processes of one machine, without a kernel module: frames over a UNIX socket.

One process is the hub (`UnixHub`, an endpoint itself), the others connect (`UnixBus`). What is *not* modelled:
arbitration, bit times, bus errors. A client that does not read loses what finds no room, and nobody else waits for it.
"""

from __future__ import annotations

import logging
import selectors
import socket
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path

import can

from hil.bus.listener import enlarge
from hil.bus.packets import DROPS, FRAME_SIZE, Hello, pack_frame, unpack_frame
from hil.bus.unix_hub import BURST, UnixHub

__all__ = ["UnixBus", "UnixHub"]

_LOG = logging.getLogger("can.unix")


class UnixBus(can.BusABC):
    """A client of a `UnixHub`, for any program that takes a python-can bus.

    Args:
        path: the hub's socket.
        now: stamps the frames received [s].

    Frames that are lost because this client does not read in time are counted, and a warning of the logger `can.unix`
    says so: for the first time, and whenever they have doubled.

    Attributes:
        dropped: frames that were lost so far, as the hub has told with the last frames, or behind them.

    Raises:
        CanInitializationError: no hub listens there.
    """

    def __init__(self, path: Path, now: Callable[[], float] = time.time) -> None:
        self._now = now
        self.dropped = 0
        self._warned = 0
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._arrived: deque[can.Message] = deque()
        enlarge(self._socket)
        try:
            self._socket.connect(str(path))
            self._socket.send(Hello(bursts=True, drops=True).pack())
        except OSError as error:
            self._socket.close()
            raise can.CanInitializationError(f"nobody listens at {path}: {error.strerror}") from error
        self._poll = selectors.DefaultSelector()
        self._poll.register(self._socket, selectors.EVENT_READ)
        self.channel_info = f"unix:{path}"
        super().__init__(channel=str(path))

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Transmit a frame.

        Raises:
            CanOperationError: the hub is gone, or the bus has been shut down.
        """
        try:
            self._socket.send(pack_frame(msg))
        except OSError as error:
            raise can.CanOperationError(f"{self.channel_info}: {error.strerror}") from error

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if self._is_shutdown:
            raise can.CanOperationError("the bus has been shut down")
        end = None if timeout is None else time.monotonic() + timeout
        while not self._arrived and self._poll.select(_left(end)):
            # What comes may be no frame, but the number of those that are lost.
            self._take()
        return (self._arrived.popleft() if self._arrived else None), False

    def _take(self) -> None:
        try:
            packet = self._socket.recv(BURST * FRAME_SIZE + DROPS.size)
        except OSError as error:
            raise can.CanOperationError(f"{self.channel_info}: {error.strerror}") from error
        if not packet:
            raise can.CanOperationError(f"{self.channel_info}: the other side has closed the bus")
        now = self._now()
        end = len(packet) // FRAME_SIZE * FRAME_SIZE
        if end < len(packet):
            self._lose(int(DROPS.unpack_from(packet, end)[0]))
        for begin in range(0, end, FRAME_SIZE):
            self._arrived.append(unpack_frame(packet[begin : begin + FRAME_SIZE], now))

    def _lose(self, dropped: int) -> None:
        self.dropped = dropped
        if dropped >= max(2 * self._warned, 1):
            self._warned = dropped
            _LOG.warning(
                "%s: %d frames are lost, because this program does not read in time", self.channel_info, dropped
            )

    def shutdown(self) -> None:
        """Leave the bus."""
        super().shutdown()
        self._poll.close()
        self._socket.close()


def _left(end: float | None) -> float | None:
    """Time until an instant [s]."""
    return None if end is None else max(end - time.monotonic(), 0.0)

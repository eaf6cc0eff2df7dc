"""A client of the hub, and the frames that wait until it reads them."""

from __future__ import annotations

import contextlib
import socket
import struct
from collections import deque
from pathlib import Path
from typing import Final

from hil.bus.packets import DROPS, FRAME_SIZE, Hello
from hil.bus.report import ListenerReport

ROOM: Final = 8192
"""Frames that the hub keeps for a client beside those in its socket: about a second of a full bus at 1 Mbit/s."""

_FLUSHED: Final = 64
"""Most packets that are handed over at once to a client that reads again: the others must not wait for it."""

_BUFFER: Final = 1 << 20
_CREDENTIALS: Final = struct.Struct("=iII")


class Listener:
    """A client of the hub; deaf until it has said what it wants to hear.

    Frames go into its socket, and where that is full into a queue of the hub. A frame that finds both full is lost for
    this client alone and counted, as in the receive queue of a CAN_RAW socket (`sk_drops`). Nothing here ever blocks.

    Args:
        connection: its socket, which becomes non-blocking.
        room: frames that the queue holds.

    Attributes:
        wants: what it has asked for.
        dropped: frames that it has lost.
        taken: frames taken from it since the hub last looked how fast it sends.
        watched: events of its socket that the hub waits for.
    """

    def __init__(self, connection: socket.socket, room: int = ROOM) -> None:
        enlarge(connection)
        connection.setblocking(False)
        self.socket = connection
        self.wants: Hello | None = None
        self.dropped = 0
        self.taken = 0
        self.watched = 0
        self._told = 0
        self._room = room
        self._waiting: deque[bytes] = deque()
        self._waiting_frames = 0

    @property
    def behind(self) -> bool:
        """Whether frames wait for room in its socket."""
        return bool(self._waiting)

    def report(self, gone: bool = False) -> ListenerReport:
        """What became of its frames."""
        pid = _process_of(self.socket)
        return ListenerReport(pid, _program_of(pid), self._waiting_frames, self.dropped, gone)

    def hand(self, packet: bytes) -> bool:
        """Hand over a packet, let it wait, or drop it; whether it is the first that has to wait.

        Raises:
            OSError: the client is gone.
        """
        if self.dropped and self.wants is not None and self.wants.drops:
            packet += DROPS.pack(self.dropped & 0xFFFFFFFF)
            self._told = self.dropped
        if self._waiting:
            self._queue(packet)
            return False
        try:
            self.socket.send(packet)
        except BlockingIOError:
            self._queue(packet)
            return True
        return False

    def flush(self) -> None:
        """Hand over some of what waits.

        Raises:
            OSError: the client is gone.
        """
        for _ in range(min(_FLUSHED, len(self._waiting))):
            try:
                self.socket.send(self._waiting[0])
            except BlockingIOError:
                return
            self._waiting_frames -= len(self._waiting.popleft()) // FRAME_SIZE
        if not self._waiting:
            self._tell_drops()

    def _tell_drops(self) -> None:
        """Say how many frames are lost after the last that was kept: perhaps nothing else comes for a long time.

        Only to those who take packets of any number of frames, none too: others take every packet for a frame.
        """
        wants = self.wants
        if wants is not None and wants.bursts and wants.drops and self._told != self.dropped:
            with contextlib.suppress(BlockingIOError):
                self.socket.send(DROPS.pack(self.dropped & 0xFFFFFFFF))
                self._told = self.dropped

    def deafen(self) -> None:
        """It is gone, and gets nothing any more; what it has sent before can still be read."""
        self.wants = None
        self._waiting.clear()
        self._waiting_frames = 0

    def _queue(self, packet: bytes) -> None:
        frames = len(packet) // FRAME_SIZE
        if self._waiting_frames + frames > self._room:
            self.dropped += frames
            return
        self._waiting.append(packet)
        self._waiting_frames += frames


def enlarge(connection: socket.socket) -> None:
    """Give a connection room for frames that are not read at once."""
    for option in (socket.SO_SNDBUF, socket.SO_RCVBUF):
        connection.setsockopt(socket.SOL_SOCKET, option, _BUFFER)


def _process_of(connection: socket.socket) -> int:
    try:
        credentials = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
    except OSError:
        return 0
    return int(_CREDENTIALS.unpack(credentials)[0])


def _program_of(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/comm").read_text(errors="replace").strip()
    except OSError:
        return ""

"""The hub of a `unix:` bus: an endpoint itself, it hands every frame on to those who want it."""

from __future__ import annotations

import contextlib
import os
import selectors
import socket
import struct
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import can

from hil.buses.packets import (
    ACKNOWLEDGEMENT,
    FRAME,
    FRAME_SIZE,
    Hello,
    marked_as_own,
    pack_frame,
    unpack_frame,
    unpack_hello,
)

BURST: Final = 64
"""Most frames in one packet."""

_LARGEST_HELLO: Final = 12 + 8 * 512
_BUFFER: Final = 1 << 20
_TIMEVAL: Final = struct.Struct("@ll")


@dataclass
class _Client:
    """Somebody at the hub; deaf until it has said what it wants to hear."""

    socket: socket.socket
    wants: Hello | None = None


class UnixHub(can.BusABC):
    """The hub: hands each client's frames to the other clients and to its own process, and sends to all.

    Args:
        path: where clients connect; a socket that a dead hub left there is replaced.
        now: stamps the frames received [s].
        send_timeout: how long a client may leave its frames unread before it is cut off [s].

    Raises:
        CanInitializationError: another hub listens there, or the path cannot be used.
    """

    def __init__(self, path: Path, now: Callable[[], float] = time.time, send_timeout: float = 1.0) -> None:
        self._path = path
        self._now = now
        self._send_timeout = send_timeout
        self._received: deque[tuple[bytes, float]] = deque()
        self._clients: list[_Client] = []
        self._burst: list[bytes] | None = None
        self._server = _listen(path)
        self._poll = selectors.DefaultSelector()
        self._poll.register(self._server, selectors.EVENT_READ)
        self.channel_info = f"hub of unix:{path}"
        super().__init__(channel=str(path))

    @property
    def clients(self) -> int:
        """Number of clients that hear this bus."""
        return sum(client.wants is not None for client in self._clients)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send a frame to every client.

        Raises:
            CanOperationError: the bus has been shut down.
        """
        if self._is_shutdown:
            raise can.CanOperationError("the bus has been shut down")
        self._send_packet(pack_frame(msg))

    def send_data(self, can_id: int, data: bytes) -> None:
        """Send a frame without the detour of a message; `can_id` carries the flags of `can_frame`."""
        self._send_packet(FRAME.pack(can_id, len(data), 0, data))

    def take(self, timeout: float) -> tuple[int, bytes] | None:
        """The next frame as identifier, with the flags of `can_frame`, and data; None after `timeout` [s]."""
        if not self._received:
            self._serve(timeout)
            if not self._received:
                return None
        can_id, length, _, data = FRAME.unpack(self._received.popleft()[0])
        return can_id, data[:length]

    @contextlib.contextmanager
    def burst(self) -> Iterator[None]:
        """Inside, frames are collected; at the end they go out together, in one packet to whoever takes that."""
        if self._burst is not None:
            yield
            return
        self._burst = []
        try:
            yield
        finally:
            packets, self._burst = self._burst, None
            self._send_burst(packets)

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if self._is_shutdown:
            raise can.CanOperationError("the bus has been shut down")
        if not self._received:
            self._serve(timeout)
        return (unpack_frame(*self._received.popleft()) if self._received else None), False

    def shutdown(self) -> None:
        """Close the bus for everybody."""
        if self._is_shutdown:
            return
        super().shutdown()
        self._poll.close()
        for client in self._clients:
            client.socket.close()
        self._server.close()
        with contextlib.suppress(FileNotFoundError):
            os.unlink(self._path)

    def _serve(self, timeout: float | None) -> None:
        for key, _ in self._poll.select(timeout):
            if key.data is None:
                self._accept()
            else:
                self._take_from(key.data)

    def _accept(self) -> None:
        connection, _ = self._server.accept()
        enlarge(connection)
        # The system's own time-out: Python's would ask before every call whether the socket is ready.
        seconds = int(self._send_timeout)
        timeout = _TIMEVAL.pack(seconds, round((self._send_timeout - seconds) * 1e6))
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, timeout)
        client = _Client(connection)
        self._clients.append(client)
        self._poll.register(connection, selectors.EVENT_READ, client)
        self._take_from(client)

    def _take_from(self, client: _Client) -> None:
        """Everything that a client has sent, so that one look at the sockets serves many frames."""
        while client in self._clients:
            try:
                packet = client.socket.recv(_LARGEST_HELLO, socket.MSG_DONTWAIT)
            except BlockingIOError:
                return
            except ConnectionResetError:
                # It has closed with frames unread. What it sent before is still to be had, after this one error.
                continue
            except OSError:
                packet = b""
            self._take(packet, client)

    def _take(self, packet: bytes, client: _Client) -> None:
        if packet and len(packet) % FRAME_SIZE == 0:
            for begin in range(0, len(packet), FRAME_SIZE):
                frame = packet[begin : begin + FRAME_SIZE]
                self._received.append((frame, self._now()))
                self._broadcast(frame, client)
        elif (hello := unpack_hello(packet)) is not None:
            client.wants = hello
            if hello.acknowledge:
                self._send_to(client, ACKNOWLEDGEMENT)
        else:
            self._drop(client)

    def _broadcast(self, packet: bytes, sender: _Client | None) -> None:
        for client in tuple(self._clients):
            wants = client.wants
            if wants is None or (client is sender and not wants.own_frames):
                continue
            if wants.everything or wants.passes(FRAME.unpack(packet)[0]):
                self._send_to(client, packet if client is not sender else marked_as_own(packet))

    def _send_packet(self, packet: bytes) -> None:
        if self._burst is None:
            self._broadcast(packet, None)
        else:
            self._burst.append(packet)

    def _send_burst(self, packets: list[bytes]) -> None:
        for client in tuple(self._clients):
            wants = client.wants
            if wants is None:
                continue
            wanted = packets if wants.everything else [one for one in packets if wants.passes(FRAME.unpack(one)[0])]
            together = BURST if wants.bursts else 1
            for begin in range(0, len(wanted), together):
                self._send_to(client, b"".join(wanted[begin : begin + together]))

    def _send_to(self, client: _Client, packet: bytes) -> None:
        try:
            client.socket.send(packet)
        except OSError:
            # Gone, or it has not read for the send time-out: the others must not wait for it.
            self._drop(client)

    def _drop(self, client: _Client) -> None:
        if client in self._clients:
            self._clients.remove(client)
            self._poll.unregister(client.socket)
            client.socket.close()


def _listen(path: Path) -> socket.socket:
    server = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    try:
        _remove_stale(path)
        server.bind(str(path))
        server.listen()
    except OSError as error:
        server.close()
        raise can.CanInitializationError(f"no bus can be opened at {path}: {error.strerror or error}") from error
    return server


def _remove_stale(path: Path) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as probe:
        try:
            probe.connect(str(path))
        except FileNotFoundError:
            return
        except ConnectionRefusedError:
            os.unlink(path)
            return
    raise OSError("another process serves it")


def enlarge(connection: socket.socket) -> None:
    """Give a connection room for frames that are not read at once."""
    for option in (socket.SO_SNDBUF, socket.SO_RCVBUF):
        connection.setsockopt(socket.SOL_SOCKET, option, _BUFFER)

"""A lossless CAN bus between processes of one machine, without a kernel module: frames over a UNIX socket.

One process is the hub (`UnixHub`, an endpoint itself), the others connect (`UnixBus`). A packet is a `can_frame`
of SocketCAN, 16 bytes. What is *not* modelled: arbitration, bit times, bus errors. A client that does not read
blocks the hub for at most its send time-out and is then cut off.
"""

from __future__ import annotations

import contextlib
import os
import selectors
import socket
import struct
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path

import can

_FRAME = struct.Struct("=IB3x8s")
"""struct can_frame of <linux/can.h>: identifier with flags, length, padding, data."""
_EXTENDED = 0x80000000
_REMOTE = 0x40000000
_ERROR = 0x20000000
_BUFFER = 1 << 20


def pack_frame(message: can.Message) -> bytes:
    """A message as `can_frame`.

    Raises:
        CanOperationError: it is a CAN FD frame.
    """
    if message.is_fd:
        raise can.CanOperationError("this bus carries classic CAN frames only")
    flags = _EXTENDED * message.is_extended_id | _REMOTE * message.is_remote_frame | _ERROR * message.is_error_frame
    return _FRAME.pack(message.arbitration_id | flags, message.dlc, bytes(message.data))


def unpack_frame(packet: bytes, timestamp: float) -> can.Message:
    """A `can_frame` as message."""
    can_id, length, data = _FRAME.unpack(packet)
    extended, remote = bool(can_id & _EXTENDED), bool(can_id & _REMOTE)
    return can.Message(
        timestamp=timestamp,
        arbitration_id=can_id & (0x1FFFFFFF if extended else 0x7FF),
        is_extended_id=extended,
        is_remote_frame=remote,
        is_error_frame=bool(can_id & _ERROR),
        dlc=length,
        data=bytearray(b"" if remote else data[:length]),
    )


class UnixBus(can.BusABC):
    """A client of a `UnixHub`, for any program that takes a python-can bus.

    Args:
        path: the hub's socket.
        now: stamps the frames received [s].

    Raises:
        CanInitializationError: no hub listens there.
    """

    def __init__(self, path: Path, now: Callable[[], float] = time.time) -> None:
        self._now = now
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        _enlarge(self._socket)
        try:
            self._socket.connect(str(path))
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
        if not self._poll.select(timeout):
            return None, False
        try:
            packet = self._socket.recv(_FRAME.size)
        except OSError as error:
            raise can.CanOperationError(f"{self.channel_info}: {error.strerror}") from error
        if not packet:
            raise can.CanOperationError(f"{self.channel_info}: the other side has closed the bus")
        return unpack_frame(packet, self._now()), False

    def shutdown(self) -> None:
        """Leave the bus."""
        super().shutdown()
        self._poll.close()
        self._socket.close()


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
        self._received: deque[can.Message] = deque()
        self._clients: list[socket.socket] = []
        self._server = _listen(path)
        self._poll = selectors.DefaultSelector()
        self._poll.register(self._server, selectors.EVENT_READ)
        self.channel_info = f"hub of unix:{path}"
        super().__init__(channel=str(path))

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send a frame to every client.

        Raises:
            CanOperationError: the bus has been shut down.
        """
        if self._is_shutdown:
            raise can.CanOperationError("the bus has been shut down")
        self._broadcast(pack_frame(msg), None)

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if self._is_shutdown:
            raise can.CanOperationError("the bus has been shut down")
        if not self._received:
            self._serve(timeout)
        return (self._received.popleft() if self._received else None), False

    def shutdown(self) -> None:
        """Close the bus for everybody."""
        if self._is_shutdown:
            return
        super().shutdown()
        self._poll.close()
        for client in self._clients:
            client.close()
        self._server.close()
        with contextlib.suppress(FileNotFoundError):
            os.unlink(self._path)

    def _serve(self, timeout: float | None) -> None:
        for key, _ in self._poll.select(timeout):
            if key.fileobj is self._server:
                self._accept()
            elif isinstance(key.fileobj, socket.socket):
                self._take_from(key.fileobj)

    def _accept(self) -> None:
        client, _ = self._server.accept()
        _enlarge(client)
        client.settimeout(self._send_timeout)
        self._clients.append(client)
        self._poll.register(client, selectors.EVENT_READ)

    def _take_from(self, client: socket.socket) -> None:
        try:
            packet = client.recv(_FRAME.size)
        except OSError:
            packet = b""
        if len(packet) != _FRAME.size:
            self._drop(client)
            return
        self._received.append(unpack_frame(packet, self._now()))
        self._broadcast(packet, client)

    def _broadcast(self, packet: bytes, sender: socket.socket | None) -> None:
        for client in tuple(self._clients):
            if client is sender:
                continue
            try:
                client.send(packet)
            except OSError:
                # Gone, or it has not read for the send time-out: the others must not wait for it.
                self._drop(client)

    def _drop(self, client: socket.socket) -> None:
        if client in self._clients:
            self._clients.remove(client)
            self._poll.unregister(client)
            client.close()


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


def _enlarge(connection: socket.socket) -> None:
    for option in (socket.SO_SNDBUF, socket.SO_RCVBUF):
        connection.setsockopt(socket.SOL_SOCKET, option, _BUFFER)

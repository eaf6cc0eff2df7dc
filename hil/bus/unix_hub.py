"""The hub of a `unix:` bus: an endpoint itself, it hands every frame on to those who want it, and waits for nobody."""

from __future__ import annotations

import contextlib
import selectors
import time
from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path
from selectors import EVENT_READ, EVENT_WRITE
from typing import Final

import can

from hil.bus.listener import ROOM, Listener
from hil.bus.pacing import TURN, Pacing
from hil.bus.packets import (
    ACKNOWLEDGEMENT,
    FRAME,
    FRAME_SIZE,
    Hello,
    marked_as_own,
    pack_frame,
    unpack_frame,
    unpack_hello,
)
from hil.bus.report import ListenerReport
from hil.bus.unix_paths import BoundSocket, listen

BURST: Final = 64
"""Most frames in one packet."""

_REMEMBERED: Final = 64
"""Clients that have left and had lost frames of which the hub still knows."""

_LARGEST_HELLO: Final = 12 + 8 * 512


class UnixHub(can.BusABC):
    """The hub: hands each client's frames to the other clients and to its own process, and sends to all.

    It never blocks on a client: see `Listener` for those that do not read, `Pacing` for those that send too much. What
    it has taken and its own process has not is at most a turn of each client.

    Args:
        path: where clients connect; a socket that a dead hub of this user left there is replaced, nothing else.
        now: stamps the frames received [s].
        bit_rate: what a client may send that does not wait for answers [bit/s].
        room: frames that wait for each client beside those in its socket.
        monotonic: paces the senders [s].

    Raises:
        CanInitializationError: another hub listens there, something else is there, or the path cannot be used.
    """

    def __init__(
        self,
        path: Path,
        now: Callable[[], float] = time.time,
        bit_rate: float = 1e6,
        room: int = ROOM,
        monotonic: Callable[[], float] = time.monotonic,
    ) -> None:
        self._now = now
        self._room = room
        self._received: deque[tuple[bytes, float]] = deque()
        self._clients: list[Listener] = []
        self._departed: deque[ListenerReport] = deque(maxlen=_REMEMBERED)
        self._burst: list[bytes] | None = None
        self._pacing = Pacing(bit_rate, monotonic)
        self._bound = _listen(path)
        self._server = self._bound.socket
        self._poll = selectors.DefaultSelector()
        self._poll.register(self._server, EVENT_READ)
        self.channel_info = f"hub of unix:{path}"
        super().__init__(channel=str(path))

    @property
    def clients(self) -> int:
        """Number of clients that hear this bus."""
        return sum(client.wants is not None for client in self._clients)

    @property
    def listeners(self) -> tuple[ListenerReport, ...]:
        """What became of the frames for each client that hears this bus."""
        return tuple(client.report() for client in self._clients if client.wants is not None)

    @property
    def departed(self) -> tuple[ListenerReport, ...]:
        """The last clients that have left the bus and had lost frames."""
        return tuple(self._departed)

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
            self._forward(packets, None)

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
        self._bound.close()

    def _serve(self, timeout: float | None) -> None:
        pacing = self._pacing
        for client in pacing.due():
            self._serve_held(client)
        timeout = 0.0 if self._received else pacing.patience(timeout)
        for key, events in self._poll.select(timeout):
            if key.data is None:
                self._accept()
                continue
            if events & EVENT_WRITE:
                self._flush(key.data)
            if events & EVENT_READ:
                self._take_from(key.data)
        for client in pacing.look(self._clients):
            self._watch(client)

    def _serve_held(self, client: Listener) -> None:
        before = client.taken
        more = self._take_from(client)
        if client in self._clients and self._pacing.judge(client, client.taken - before, more):
            self._watch(client)

    def _accept(self) -> None:
        connection, _ = self._server.accept()
        client = Listener(connection, self._room)
        self._clients.append(client)
        self._watch(client)
        self._take_from(client)

    def _watch(self, client: Listener) -> None:
        """Wait for what there is to do for a client: frames of it, unless it has to wait, and room for those to it."""
        wanted = EVENT_WRITE * client.behind | EVENT_READ * (not self._pacing.holds(client))
        if wanted == client.watched:
            return
        if not client.watched:
            self._poll.register(client.socket, wanted, client)
        elif wanted:
            self._poll.modify(client.socket, wanted, client)
        else:
            self._poll.unregister(client.socket)
        client.watched = wanted

    def _take_from(self, client: Listener) -> bool:
        """A turn of a client: what it has sent, so that one look at the sockets serves many; whether more may wait."""
        frames: list[bytes] = []
        more = self._read_turn(client, frames)
        if frames:
            client.taken += len(frames)
            now = self._now()
            self._received.extend((frame, now) for frame in frames)
            self._forward(frames, client)
        return more

    def _read_turn(self, client: Listener, frames: list[bytes]) -> bool:
        hellos = 0
        while len(frames) + hellos < TURN:
            try:
                packet = client.socket.recv(_LARGEST_HELLO)
            except BlockingIOError:
                return False
            except ConnectionResetError:
                # It has closed with frames unread. What it sent before is still to be had, after this one error.
                continue
            except OSError:
                packet = b""
            if len(packet) == FRAME_SIZE:
                frames.append(packet)
            elif packet and len(packet) % FRAME_SIZE == 0:
                frames.extend(packet[begin : begin + FRAME_SIZE] for begin in range(0, len(packet), FRAME_SIZE))
            elif self._greet(packet, client):
                hellos += 1
            else:
                self._drop(client)
                return False
        return True

    def _greet(self, packet: bytes, client: Listener) -> bool:
        """Act on a packet that holds no frames; False where the client has closed or sends rubbish."""
        hello = unpack_hello(packet)
        if hello is None:
            return False
        client.wants = hello
        if hello.acknowledge:
            self._send_to(client, ACKNOWLEDGEMENT)
        return True

    def _forward(self, frames: list[bytes], sender: Listener | None) -> None:
        """Hand frames to all who want them, together to those who take them so."""
        for client in self._clients:
            wants = client.wants
            if wants is None:
                continue
            if client is not sender:
                self._send_wanted(client, wants, frames)
            elif wants.own_frames:
                self._send_wanted(client, wants, [marked_as_own(frame) for frame in frames])

    def _send_wanted(self, client: Listener, wants: Hello, frames: list[bytes]) -> None:
        if not wants.everything:
            frames = [frame for frame in frames if wants.passes(FRAME.unpack(frame)[0])]
        together = BURST if wants.bursts else 1
        for begin in range(0, len(frames), together):
            self._send_to(client, b"".join(frames[begin : begin + together]))

    def _send_packet(self, packet: bytes) -> None:
        if self._burst is None:
            self._forward([packet], None)
        else:
            self._burst.append(packet)

    def _send_to(self, client: Listener, packet: bytes) -> None:
        try:
            if client.hand(packet):
                self._watch(client)
        except OSError:
            # Gone; what it has sent before may still be read, and after that its end.
            client.deafen()
            self._watch(client)

    def _flush(self, client: Listener) -> None:
        try:
            client.flush()
        except OSError:
            client.deafen()
        self._watch(client)

    def _drop(self, client: Listener) -> None:
        if client.dropped:
            self._departed.append(client.report(gone=True))
        self._clients.remove(client)
        self._pacing.forget(client)
        if client.watched:
            self._poll.unregister(client.socket)
        client.socket.close()


def _listen(path: Path) -> BoundSocket:
    try:
        return listen(path)
    except OSError as error:
        raise can.CanInitializationError(f"no bus can be opened at {path}: {error.strerror or error}") from error

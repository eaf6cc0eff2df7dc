"""Devices behind a wire: frames reach them, and leave them, when the bus has had the time to carry them."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Protocol

from hil.bus.bit_length import device_frame_bits, frame_bits
from hil.bus.wire import Wire, arbitration_key


class Devices(Protocol):
    """Emulated nodes on a bus; they answer through the function that they were made with."""

    def receive(self, can_id: int, data: bytes, /) -> None:
        """Take a data frame."""

    def receive_remote(self, can_id: int) -> None:
        """Take a remote frame."""

    def advance(self, to_time: float) -> None:
        """Let simulated time pass up to `to_time` [s], timers and physics included."""

    def next_event(self) -> float:
        """Instant [s] of the next timer, infinite if there is none."""

    @property
    def time(self) -> float:
        """The instant [s] that the devices have reached; inside `advance`, that of the timer that runs."""


Send = Callable[[int, bytes], None]
"""Takes a frame of the devices: identifier, perhaps with `ERROR_FRAME` in it, and data."""


class WiredDevices:
    """Devices whose frames wait for arbitration and take their bit times.

    Every identifier that the devices send is a source of its own: a controller with a mailbox for each.

    Args:
        make: builds the devices around the function by which they send.
        wire: what is between.
        send: takes a frame of the devices at its end: identifier, data and the instant [s].
        start: the instant at which they are made, and may send already [s].
    """

    def __init__(
        self,
        make: Callable[[Send], Devices],
        wire: Wire,
        send: Callable[[int, bytes, float], None],
        start: float = 0.0,
    ) -> None:
        self._wire = wire
        self._send = send
        self._start = start
        self._made = False
        self._devices = make(self._from_device)
        self._made = True

    @property
    def time(self) -> float:
        """The instant that the devices have reached [s]."""
        return self._devices.time if self._made else self._start

    def receive(self, can_id: int, data: bytes) -> None:
        """Put a data frame on the wire that the devices hear at its end."""
        bits = frame_bits(can_id, data)
        self.request(None, arbitration_key(can_id), bits, lambda _: self._devices.receive(can_id, data))

    def request(self, source: Hashable, key: int, bits: int, deliver: Callable[[float], None]) -> None:
        """Ask for the wire on behalf of somebody else; see `Wire.request`."""
        self._wire.request(self.time, source, key, bits, deliver)

    def hand_over(self, can_id: int, data: bytes) -> None:
        """Give the devices a frame that has been on the wire."""
        self._devices.receive(can_id, data)

    def receive_remote(self, can_id: int) -> None:
        """Give the devices a remote frame that has been on the wire."""
        self._devices.receive_remote(can_id)

    def advance(self, to_time: float) -> None:
        """Let time pass up to `to_time` [s]: timers, physics, and the frames on the wire."""
        due = min(self.next_event(), to_time)
        while due < to_time or self.next_event() <= to_time:
            self._devices.advance(due)
            self._wire.run(due)
            due = min(self.next_event(), to_time)
        self._devices.advance(to_time)

    def settle(self, to_time: float) -> None:
        """Let time pass until the wire is free, at most up to `to_time` [s]."""
        while (end := self._wire.next_event()) <= to_time:
            self.advance(end)

    def next_event(self) -> float:
        """Instant of the next timer or end of a frame [s], infinite if there is none."""
        return min(self._wire.next_event(), self._devices.next_event())

    def _from_device(self, can_id: int, data: bytes) -> None:
        bits = device_frame_bits(can_id, data)
        self.request(can_id, arbitration_key(can_id), bits, lambda end: self._send(can_id, data, end))

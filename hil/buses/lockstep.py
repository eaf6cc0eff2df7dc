"""A deterministic, lossless bus inside one process, whose SYNC moves simulated time.

What is *not* modelled: arbitration between frames that are requested while the bus is busy (they go out in the
order of the requests), bit errors, and the delay of delivery: a frame is delivered in the instant in which it is
sent, while its time stamp says when its last bit would have left the wire.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Protocol

import can

from hil.buses.bit_length import frame_bits
from hil.clock import SimulatedClock


class Devices(Protocol):
    """The emulated nodes on the bus; they answer through the function given to `LockstepHub.attach`."""

    def receive(self, can_id: int, data: bytes) -> None:
        """Take a data frame."""

    def advance(self, to_time: float) -> None:
        """Let simulated time pass up to `to_time` [s], timers and physics included."""

    def next_event(self) -> float:
        """Instant [s] of the next timer, infinite if there is none."""

    @property
    def time(self) -> float:
        """The instant [s] that the devices have reached; inside `advance`, that of the timer that runs."""


class LockstepHub:
    """Joins the endpoints of one bus with the emulated devices on it.

    SYNC number k first moves time from t_(k-1) to t_k = t_(k-1) + cycle period (not at all where somebody has
    moved it there already), and is delivered then. Before the first SYNC, and while a master waits for frames,
    a blocking `recv` moves time from one timer of the devices to the next.

    Args:
        cycle_period: time between SYNCs [s].
        bit_rate: [bit/s], for time stamps.
        sync_cob_id: identifier of the SYNC.
    """

    def __init__(self, cycle_period: float, bit_rate: float, sync_cob_id: int = 0x80) -> None:
        self._cycle_period = cycle_period
        self._bit_time = 1.0 / bit_rate
        self._sync_cob_id = sync_cob_id
        self._endpoints: list[LockstepBus] = []
        self._devices: Devices | None = None
        self._last_sync: float | None = None
        self._bus_free = 0.0
        self.clock = SimulatedClock(self._advance_devices)

    def attach(self, make: Callable[[Callable[[int, bytes], None]], Devices]) -> None:
        """Connect the devices that `make` builds around the function by which they send frames."""
        self._devices = make(self._send_from_devices)

    def open(self) -> LockstepBus:
        """A new endpoint of this bus."""
        bus = LockstepBus(self)
        self._endpoints.append(bus)
        return bus

    def leave(self, bus: LockstepBus) -> None:
        """Take an endpoint off the bus."""
        if bus in self._endpoints:
            self._endpoints.remove(bus)

    def send(self, message: can.Message, sender: LockstepBus) -> None:
        """Put a frame of an endpoint on the bus; its time stamp is set to the end of the frame."""
        can_id = message.arbitration_id
        if can_id == self._sync_cob_id and not message.is_extended_id:
            self._pace()
        data = bytes(message.data)
        message.timestamp = self._occupy(
            frame_bits(can_id, data, message.is_extended_id, message.is_remote_frame, message.dlc),
            self.clock.now(),
        )
        for endpoint in self._endpoints:
            if endpoint is not sender:
                endpoint.deliver(_copy(message))
        if self._devices is not None and not (message.is_extended_id or message.is_remote_frame):
            self._devices.receive(can_id, data)

    def wait_for_event(self, deadline: float) -> bool:
        """Move time to the next timer of the devices, at most to `deadline` [s]; False when that has come.

        Raises:
            CanOperationError: nothing will ever happen, and the deadline is infinite.
        """
        now = self.clock.now()
        event = self._devices.next_event() if self._devices is not None else float("inf")
        target = max(now, min(deadline, event))
        if target == float("inf"):
            raise can.CanOperationError("recv would wait forever: simulated time stands still, no timer is set")
        self.clock.wait_until(target)
        return event <= deadline

    def catch_up(self, stamp: float) -> None:
        """Let time pass, in whole cycle periods, when frames queue up on the bus for longer than one of them.

        Without this a burst of SDO transfers, each answered in the instant it is asked, would take no time at all.
        """
        if stamp - self.clock.now() > self._cycle_period:
            self.clock.wait_until(round(stamp // self._cycle_period * self._cycle_period, 9))

    def _pace(self) -> None:
        if self._last_sync is not None:
            # Rounded so that the grid of cycles does not drift by the sum of rounding errors.
            self.clock.wait_until(round(self._last_sync + self._cycle_period, 9))
        self._last_sync = self.clock.now()

    def _advance_devices(self, instant: float) -> None:
        if self._devices is not None:
            self._devices.advance(instant)

    def _occupy(self, bits: int, now: float) -> float:
        self._bus_free = max(self._bus_free, now) + bits * self._bit_time
        return self._bus_free

    def _send_from_devices(self, can_id: int, data: bytes) -> None:
        now = self.clock.now() if self._devices is None else self._devices.time
        stamp = self._occupy(frame_bits(can_id, data), now)
        for endpoint in self._endpoints:
            endpoint.deliver(
                can.Message(timestamp=stamp, arbitration_id=can_id, is_extended_id=False, data=bytearray(data))
            )


def _copy(message: can.Message) -> can.Message:
    return can.Message(
        timestamp=message.timestamp,
        arbitration_id=message.arbitration_id,
        is_extended_id=message.is_extended_id,
        is_remote_frame=message.is_remote_frame,
        is_error_frame=message.is_error_frame,
        dlc=message.dlc,
        data=bytearray(message.data),
    )


class LockstepBus(can.BusABC):
    """One endpoint of a `LockstepHub`, for any program that takes a python-can bus."""

    def __init__(self, hub: LockstepHub) -> None:
        self._hub = hub
        self._queue: deque[can.Message] = deque()
        self.channel_info = "lockstep bus in this process"
        super().__init__(channel="lockstep")

    def deliver(self, message: can.Message) -> None:
        """Queue a frame for this endpoint."""
        self._queue.append(message)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Transmit; delivered when this returns. The time stamp of `msg` becomes that of the bus.

        Raises:
            CanOperationError: the bus has been shut down.
        """
        self._refuse_closed()
        self._hub.send(msg, self)

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """The next frame that passes the filters, or None when `timeout` seconds of *simulated* time are over.

        Raises:
            CanOperationError: the bus has been shut down, or nothing would ever arrive.
        """
        self._refuse_closed()
        message = self._next()
        if message is not None or timeout == 0:
            return message
        return self._wait(float("inf") if timeout is None else self._hub.clock.now() + timeout)

    def shutdown(self) -> None:
        """Leave the bus."""
        super().shutdown()
        self._hub.leave(self)

    def _wait(self, deadline: float) -> can.Message | None:
        more = True
        while more:
            more = self._hub.wait_for_event(deadline)
            message = self._next()
            if message is not None:
                return message
        return None

    def _next(self) -> can.Message | None:
        while self._queue:
            message = self._queue.popleft()
            self._hub.catch_up(message.timestamp)
            if self._filters is None or self._matches_filters(message):
                return message
        return None

    def _refuse_closed(self) -> None:
        if self._is_shutdown:
            raise can.CanOperationError("the bus has been shut down")

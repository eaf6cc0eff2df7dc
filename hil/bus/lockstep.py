"""A deterministic, lossless bus inside one process, whose SYNC moves simulated time.

By default a frame is delivered in the instant in which it is sent, in the order of the requests, while its time stamp
says when its last bit would have left the wire. With `delays` it waits for arbitration and is delivered with its last
bit. What is *not* modelled in either: bit errors and retransmission.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Protocol

import can

from hil.bus.bit_length import device_frame_bits, frame_bits
from hil.bus.clock import SimulatedClock
from hil.bus.frame_kinds import ERROR_FRAME, device_frame
from hil.bus.wire import BusLoad, Wire, arbitration_key
from hil.bus.wired import Devices, Send, WiredDevices
from hil.network.cia import Service


class _Endpoint(Protocol):
    def deliver(self, message: can.Message) -> None: ...


@dataclass(frozen=True)
class _Listener:
    deliver: Callable[[can.Message], None]


class LockstepHub:
    """Joins the endpoints of one bus with the emulated devices on it.

    SYNC number k first moves time from t_(k-1) to t_k = t_(k-1) + cycle period (not at all where somebody has
    moved it there already), and is sent then. Before the first SYNC, and while a master waits for frames,
    a blocking `recv` moves time from one timer of the devices, or end of a frame, to the next.

    Args:
        cycle_period: time between SYNCs [s].
        bit_rate: [bit/s].
        sync_cob_id: identifier of the SYNC.
        delays: frames wait for arbitration and take their bit times.

    Attributes:
        clock: simulated time.
    """

    def __init__(
        self, cycle_period: float, bit_rate: float, sync_cob_id: int = Service.SYNC, *, delays: bool = False
    ) -> None:
        self._cycle_period = cycle_period
        self._sync_cob_id = sync_cob_id
        self._endpoints: list[_Endpoint] = []
        self._wire = Wire(bit_rate)
        self._delays = delays
        self._devices: Devices | None = None
        self._wired: WiredDevices | None = None
        self._last_sync: float | None = None
        self._attend: Callable[[], None] | None = None
        self.clock = SimulatedClock(self._advance_devices)

    @property
    def load(self) -> BusLoad:
        """How busy the bus was."""
        return self._wire.load

    def attach(self, make: Callable[[Send], Devices]) -> None:
        """Connect the devices that `make` builds around the function by which they send frames."""
        if self._delays:
            self._devices = self._wired = WiredDevices(make, self._wire, self._deliver_from_devices, self.clock.now())
        else:
            self._devices = make(self._send_from_devices)

    def open(self) -> LockstepBus:
        """A new endpoint of this bus."""
        bus = LockstepBus(self)
        self._endpoints.append(bus)
        return bus

    def listen(self, hear: Callable[[can.Message], None]) -> None:
        """Call `hear` with a copy of every frame, as it passes; it must not touch the bus."""
        self._endpoints.append(_Listener(hear))

    def attend(self, call: Callable[[], None]) -> None:
        """Call `call` before every move of time."""
        self._attend = call

    def leave(self, bus: LockstepBus) -> None:
        """Take an endpoint off the bus."""
        if bus in self._endpoints:
            self._endpoints.remove(bus)

    def send(self, message: can.Message, sender: LockstepBus) -> None:
        """Put a frame of an endpoint on the bus.

        Its time stamp is set to the end of the frame, with `delays` to the instant of the request.
        """
        can_id, extended, remote = message.arbitration_id, message.is_extended_id, message.is_remote_frame
        if can_id == self._sync_cob_id and not extended:
            self._pace()
        now = self.clock.now()
        bits = frame_bits(can_id, bytes(message.data), extended, remote, message.dlc)
        if self._wired is None:
            message.timestamp = self._wire.occupy(now, bits)
            self._deliver(message, sender)
            return
        message.timestamp = now
        key = arbitration_key(can_id, extended, remote)
        self._wired.request(sender, key, bits, partial(self._deliver_at, _copy(message), sender))

    def wait_for_event(self, deadline: float) -> bool:
        """Move time to the next event of the devices, at most to `deadline` [s]; False when that has come.

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

    def _deliver_at(self, message: can.Message, sender: LockstepBus, end: float) -> None:
        message.timestamp = end
        self._deliver(message, sender)

    def _deliver(self, message: can.Message, sender: LockstepBus) -> None:
        for endpoint in self._endpoints:
            if endpoint is not sender:
                endpoint.deliver(_copy(message))
        if self._devices is None or message.is_extended_id or message.is_error_frame:
            return
        if message.is_remote_frame:
            self._devices.receive_remote(message.arbitration_id)
            return
        receive = self._devices.receive if self._wired is None else self._wired.hand_over
        receive(message.arbitration_id, bytes(message.data))

    def _pace(self) -> None:
        if self._last_sync is not None:
            # Rounded so that the grid of cycles does not drift by the sum of rounding errors.
            self.clock.wait_until(round(self._last_sync + self._cycle_period, 9))
        self._last_sync = self.clock.now()

    def _advance_devices(self, instant: float) -> None:
        if self._attend is not None:
            self._attend()
        if self._devices is not None:
            self._devices.advance(instant)

    def _send_from_devices(self, can_id: int, data: bytes) -> None:
        now = self.clock.now() if self._devices is None else self._devices.time
        bits = device_frame_bits(can_id, data)
        self._deliver_from_devices(can_id, data, self._wire.occupy(now, bits, can_id >= ERROR_FRAME))

    def _deliver_from_devices(self, can_id: int, data: bytes, stamp: float) -> None:
        for endpoint in self._endpoints:
            endpoint.deliver(device_frame(can_id, data, stamp))


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

"""The master's access to the bus: one thread, every frame through one place, time-outs in the clock's time."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

import can
import canopen

from hil.bus.clock import Clock
from hil.network.cia import HIGHEST_CAN_ID
from ident.errors import BusError

Tap = Callable[[can.Message], None]
"""Sees every frame, sent (`is_rx` False) and received, with its time stamp."""


def is_data_frame(message: can.Message) -> bool:
    """A data frame with an 11-bit identifier: the only kind that CANopen uses here."""
    return not (message.is_extended_id or message.is_error_frame or message.is_remote_frame)


class Link(canopen.Network):
    """A canopen network without a receiving thread: frames are taken from the bus when the master waits for them.

    Args:
        bus: any python-can bus.
        clock: its `now` stamps the frames sent on buses that do not stamp them.
        tap: sees every frame; the recorder.
    """

    def __init__(self, bus: can.BusABC, clock: Clock, tap: Tap | None = None) -> None:
        super().__init__(bus)
        self._can = bus
        self._clock = clock
        self._tap = tap

    @contextlib.contextmanager
    def record_may_fail(self) -> Iterator[None]:
        """Inside, frames pass even when the tap raises: on a full disk the drives must still be stopped."""
        tap = self._tap
        if tap is not None:
            self._tap = _forgiving(tap)
        try:
            yield
        finally:
            self._tap = tap

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        """Send a data frame; called by canopen's SDO and NMT services too."""
        self.transmit(
            can.Message(arbitration_id=can_id, data=data, is_extended_id=can_id > HIGHEST_CAN_ID, is_rx=False)
        )

    def transmit(self, message: can.Message) -> None:
        """Send a frame and show it to the tap.

        Raises:
            BusError: the interface reports an error.
        """
        message.timestamp = self._clock.now()
        try:
            self._can.send(message)
        except can.CanError as error:
            raise _failed(error) from error
        if self._tap is not None:
            self._tap(message)

    def receive(self, timeout: float) -> can.Message | None:
        """The next frame, shown to the tap; None when there was none in `timeout` seconds.

        Raises:
            BusError: the interface reports an error.
        """
        try:
            message = self._can.recv(timeout)
        except can.CanError as error:
            raise _failed(error) from error
        if message is not None and self._tap is not None:
            self._tap(message)
        return message

    def dispatch(self, message: can.Message) -> None:
        """Hand a frame to whoever subscribed to its identifier."""
        if is_data_frame(message):
            self.notify(message.arbitration_id, message.data, message.timestamp)

    def pump(self, duration: float, done: Callable[[], bool] = lambda: False) -> bool:
        """Receive and dispatch until `done()` or for `duration` seconds; what `done` says at the end."""
        deadline = self._clock.now() + duration
        remaining = duration
        while not done() and remaining > 0.0:
            message = self.receive(remaining)
            if message is None:
                break
            self.dispatch(message)
            remaining = deadline - self._clock.now()
        return done()

    def drain(self) -> None:
        """Dispatch what has arrived, without waiting."""
        while (message := self.receive(0.0)) is not None:
            self.dispatch(message)


def _forgiving(tap: Tap) -> Tap:
    def tapped(message: can.Message) -> None:
        with contextlib.suppress(Exception):
            tap(message)

    return tapped


def _failed(error: can.CanError) -> BusError:
    return BusError(f"The CAN interface reports: {error}.", "Check cable, bit rate and that the other side runs.")

"""An FMU of FMI-LS-BUS as the devices of a bus of ours: its frames come and go as those of emulated nodes do."""

from __future__ import annotations

from collections.abc import Callable

from hil.lsbus.instance import BusFmuInstance
from hil.lsbus.operations import CanFrame, frames, transmit


class LsBusDevices:
    """Connects an instance with whoever carries its frames; every frame arrives in the instant in which it is sent.

    Args:
        instance: with a bus terminal, freshly initialised.
        send: takes each frame of the devices (identifier, data).
    """

    def __init__(self, instance: BusFmuInstance, send: Callable[[int, bytes], None]) -> None:
        self._instance = instance
        self._send = send
        self._deliver()

    @property
    def time(self) -> float:
        """The instant that the devices have reached [s]."""
        return self._instance.time

    def receive(self, can_id: int, data: bytes) -> None:
        """Take a data frame; the answers go out before this returns."""
        self._give(CanFrame(can_id, bytes(data)))

    def receive_remote(self, can_id: int) -> None:
        """Take a remote frame; the answers go out before this returns."""
        self._give(CanFrame(can_id, remote=True))

    def advance(self, to_time: float) -> None:
        """Let time pass up to `to_time` [s], stopping where Tx_Clock ticks."""
        while self._instance.time < to_time:
            tick = min(self._instance.next_tick, to_time)
            if self._instance.advance(tick) or self._instance.next_tick <= tick:
                self._deliver()

    def next_event(self) -> float:
        """Instant of Tx_Clock's next tick [s], infinite if there is none."""
        return self._instance.next_tick

    def _give(self, frame: CanFrame) -> None:
        self._instance.give(transmit(frame))
        self._deliver()

    def _deliver(self) -> None:
        while self._instance.next_tick <= self._instance.time:
            for frame in frames(self._instance.take()):
                self._send(frame.can_id, frame.data)

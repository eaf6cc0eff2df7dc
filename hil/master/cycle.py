"""One cycle on the bus: RPDOs, SYNC, TPDOs; the fast path."""

from __future__ import annotations

import contextlib
import math
import struct
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import can

from hil.bus.clock import Clock
from hil.master.codec import (
    CommandFrames,
    Counter,
    CycleLayout,
)
from hil.master.errors import ConfigurationError, NodeLostError
from hil.master.link import Link, is_data_frame
from hil.network import Network
from hil.network.cia import Index

Fields = tuple[int, ...]

_GRID_TOLERANCE = 1e-6
"""Lateness [s] that is rounding, not waiting."""


class Sample(NamedTuple):
    """What the nodes measured at one SYNC; SI units, vehicle signs (positive rolls forward, or turns left)."""

    time: float
    """Since the master's first SYNC [s]."""
    motor_torques: tuple[float, float, float, float]
    """Motor shaft torques fl, rl, fr, rr [Nm]."""
    wheel_angles: tuple[float, float, float, float]
    """Rolling angles beta fl, rl, fr, rr [rad]."""
    steering_angles: tuple[float, float]
    """alpha_l, alpha_r [rad]."""


class Cycle:
    """Sends commands and collects samples, one SYNC at a time.

    Args:
        link: the bus.
        clock: paces the SYNCs.
        network: the network file.
    """

    def __init__(self, link: Link, clock: Clock, network: Network) -> None:
        self._link = link
        self._clock = clock
        self._period = network.cycle_period
        self._timeout = network.times["sample_timeout"]
        self._layout = CycleLayout(network)
        self.commands = [CommandFrames(node) for node in network.drives]
        self._command_messages = [message for command in self.commands for message in command.messages]
        self._sync = can.Message(arbitration_id=network.sync_cob_id, is_extended_id=False, is_rx=False)
        field = self._layout.field
        self._status = [field(node, Index.STATUSWORD) for node in network.drives]
        self._torque = [(*field(node, Index.TORQUE_ACTUAL), node.torque_unit) for node in network.drives]
        self._position = [(*field(node, Index.POSITION_ACTUAL), Counter(node)) for node in network.drives]
        self._encoder = [(*field(node, Index.ENCODER_POSITION), Counter(node)) for node in network.encoders]
        self._origin: float | None = None
        self._number = 0
        self._shift = 0.0
        self.statuswords: tuple[int, ...] = (0, 0, 0, 0)
        self.overruns = 0

    @property
    def time(self) -> float:
        """Instant of the present cycle, since the first SYNC [s]."""
        # From the count, not from the clock: sums of periods at the size of Unix time lose 50 us a second.
        return self._number * self._period + self._shift

    def resume(self) -> None:
        """The next cycle begins now, however long ago the last one was; that is no overrun."""
        if self._origin is not None:
            self._shift = self._clock.now() - self._origin - (self._number + 1) * self._period

    def exchange(self, motor_torques: Sequence[float]) -> Sample:
        """Send the commands, wait for the next cycle, send SYNC, and collect what was sampled at it.

        Args:
            motor_torques: (4,) commanded motor torques [Nm], vehicle signs; they act from this SYNC on.

        Raises:
            NodeLostError: a TPDO did not come.
            ConfigurationError: a TPDO has another length than the network file says.
        """
        for command, torque in zip(self.commands, motor_torques, strict=True):
            command.set_torque(torque)
        transmit = self._link.transmit
        for message in self._command_messages:
            transmit(message)
        self._pace()
        transmit(self._sync)
        return self._decode(self._collect())

    def sync_only(self) -> None:
        """Send the commands and a SYNC, and dispatch whatever comes, without insisting on an answer."""
        for message in self._command_messages:
            self._link.transmit(message)
        self._pace()
        self._link.transmit(self._sync)

    @contextlib.contextmanager
    def watching(self) -> Iterator[None]:
        """Inside, `statuswords` follow whatever TPDOs are dispatched, for as long as `sync_only` is used."""
        watchers = [
            (can_id, self._watcher(drive, slot, field))
            for drive, (slot, field) in enumerate(self._status)
            for can_id, of_slot in self._layout.slots.items()
            if of_slot == slot
        ]
        for can_id, watch in watchers:
            self._link.subscribe(can_id, watch)
        try:
            yield
        finally:
            for can_id, watch in watchers:
                self._link.unsubscribe(can_id, watch)

    def _watcher(self, drive: int, slot: int, field: int) -> Callable[[int, bytearray, float], None]:
        layout = self._layout.structs[slot]

        def watch(_can_id: int, data: bytearray, _timestamp: float) -> None:
            if len(data) == layout.size:
                words = list(self.statuswords)
                words[drive] = layout.unpack(data)[field]
                self.statuswords = tuple(words)

        return watch

    def _pace(self) -> None:
        if self._origin is None:
            self._origin = self._clock.now()
        else:
            self._number += 1
        lateness = self._clock.wait_until(round(self._origin + self.time, 9))
        if lateness > self._period - _GRID_TOLERANCE:
            # Whole cycles are left out, so that every SYNC stays on the grid and none follows another too soon.
            self.overruns += 1
            self._number += math.ceil((lateness - _GRID_TOLERANCE) / self._period)
            self._clock.wait_until(round(self._origin + self.time, 9))
        self._link.drain()

    def _collect(self) -> list[Fields]:
        layout = self._layout
        slots, structs = layout.slots, layout.structs
        receive = self._link.receive
        frames: list[Fields | None] = [None] * len(structs)
        missing = len(structs)
        timeout = self._timeout
        deadline = self._clock.now() + timeout
        while missing:
            message = receive(timeout) if timeout > 0.0 else None
            if message is None:
                raise self._lost(frames)
            slot = slots.get(message.arbitration_id) if is_data_frame(message) else None
            if slot is None or frames[slot] is not None:
                self._link.dispatch(message)
                timeout = deadline - self._clock.now()
                continue
            try:
                frames[slot] = structs[slot].unpack(message.data)
            except struct.error as error:
                raise self._wrong_length(slot, message) from error
            missing -= 1
        return frames  # type: ignore[return-value]  # none is missing

    def _decode(self, frames: list[Fields]) -> Sample:
        self.statuswords = tuple([frames[slot][field] for slot, field in self._status])
        fl, rl, fr, rr = [frames[slot][field] * unit for slot, field, unit in self._torque]
        b_fl, b_rl, b_fr, b_rr = [counter.angle(frames[slot][field]) for slot, field, counter in self._position]
        left, right = [counter.angle(frames[slot][field]) for slot, field, counter in self._encoder]
        return Sample(self.time, (fl, rl, fr, rr), (b_fl, b_rl, b_fr, b_rr), (left, right))

    def _lost(self, frames: Sequence[Fields | None]) -> NodeLostError:
        owners = {self._layout.owners[slot].label for slot, frame in enumerate(frames) if frame is None}
        return NodeLostError(
            f"{', '.join(sorted(owners))} sent no TPDO within {self._timeout:g} s of the SYNC at "
            f"t = {self.time:.3f} s.",
            "Check its supply and cable; the drives are being stopped.",
        )

    def _wrong_length(self, slot: int, message: can.Message) -> ConfigurationError:
        return ConfigurationError(
            f"{self._layout.owners[slot].label} sent TPDO {message.arbitration_id:03X}h with {len(message.data)} bytes "
            f"instead of {self._layout.structs[slot].size}.",
            "See that no other node or master uses this identifier.",
        )

"""Receive PDOs: applied at once or with the next SYNC, watched for length and for missing (CiA 301, 7.2.2)."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from emulator.firmware.dictionary import Dictionary
from emulator.firmware.pdo import DUMMIES, PdoIndices, PdoParameters
from emulator.firmware.sync import SyncService
from emulator.firmware.timers import Timer, Timers

_EVENT_TIMER = 5
"""Sub-index of the deadline of an RPDO [ms]."""


@dataclass(frozen=True)
class RpdoEvents:
    """What an RPDO tells its node.

    Attributes:
        changed: its parameters have been written.
        applied: all its values are in the object dictionary.
        wrong_length: it came too short (False) or too long (True).
        right_length: it came as it should after it had not.
        missing: it did not come within its event timer.
        back: it came again after it had been missing.
    """

    changed: Callable[[], None]
    applied: Callable[[], None]
    wrong_length: Callable[[bool], None]
    right_length: Callable[[], None]
    missing: Callable[[], None]
    back: Callable[[], None]


class Rpdo(PdoParameters):
    """A receive PDO.

    Args:
        dictionary: the object dictionary of the node.
        indices: where its parameters are.
        timers: simulated time, for the event timer.
        sync: knows whether the synchronous window is still open.
        events: what it tells its node.
    """

    receives = True

    def __init__(
        self, dictionary: Dictionary, indices: PdoIndices, timers: Timers, sync: SyncService, events: RpdoEvents
    ) -> None:
        super().__init__(dictionary, indices, events.changed)
        self._sync = sync
        self._timers = timers
        self._events = events
        self._struct = struct.Struct("<")
        self._writers: Sequence[Callable[[int], None]] = ()
        self._waiting: bytes | None = None
        self._misfit = False
        self._period = 0.0
        self._deadline = 0.0
        self._watch: Timer | None = None
        self._missing = False
        dictionary.on_write(indices.communication, _EVENT_TIMER, self._write_event_timer)

    def load(self) -> None:
        """Take everything from the dictionary, as after a reset."""
        super().load()
        self._misfit = self._missing = False
        self.stop()
        self._period = self._dictionary.value(self._indices.communication, _EVENT_TIMER, default=0) * 1e-3

    def compile(self) -> None:
        """Bind the mapped objects; what waits for a SYNC is dropped."""
        self._struct = struct.Struct(self.codes())
        self._writers = [self._dictionary.writer(*key) if key[0] not in DUMMIES else _skip for key in self.keys()]
        self._waiting = None

    def stop(self) -> None:
        """No longer wait for it: it is watched again from the next one on."""
        if self._watch is not None:
            self._watch.cancel()
            self._watch = None

    def receive(self, _can_id: int, data: bytes) -> None:
        """Take the PDO from the bus; one that is too short is not processed (CiA 301, 7.2.2.5)."""
        size = self._struct.size
        if len(data) != size:
            self._misfit = True
            self._events.wrong_length(len(data) > size)
            if len(data) < size:
                return
            data = data[:size]
        elif self._misfit:
            self._misfit = False
            self._events.right_length()
        if self._period:
            self._meet_deadline()
        if self.synchronous:
            if not (self._sync.window and self._sync.window_closed):
                self._waiting = data
        else:
            self._apply(data)

    def sync(self) -> None:
        """Apply what has come since the last SYNC."""
        if self._waiting is not None:
            data, self._waiting = self._waiting, None
            self._apply(data)

    def _apply(self, data: bytes) -> None:
        for write, value in zip(self._writers, self._struct.unpack(data), strict=True):
            write(value)
        # Only when the whole PDO is in place does the device act on it (a controlword on the new target).
        self._events.applied()

    def _meet_deadline(self) -> None:
        # Moving the deadline is cheaper than a new timer for every PDO; the timer looks when it is due.
        self._deadline = self._timers.now + self._period
        if self._watch is None:
            self._watch = self._timers.after(self._period, self._check)
        if self._missing:
            self._missing = False
            self._events.back()

    def _check(self) -> None:
        remaining = self._deadline - self._timers.now
        if remaining > 1e-9:
            self._watch = self._timers.after(remaining, self._check)
            return
        self._watch = None
        self._missing = True
        self._events.missing()

    def _write_event_timer(self, value: int) -> None:
        self.stop()
        self._period = value * 1e-3


def _skip(_value: int) -> None:
    """Dummy mapping: the bytes are ignored."""

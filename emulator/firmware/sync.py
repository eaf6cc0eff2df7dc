"""SYNC consumer and producer of a node: 1005h, 1006h, 1007h, 1019h (CiA 301, 7.2.5)."""

from __future__ import annotations

from collections.abc import Callable

from emulator.firmware.cob_ids import IDENTIFIER, check_change, check_cob_id
from emulator.firmware.dictionary import AbortCode, AbortError, Dictionary
from emulator.firmware.timers import Timer, Timers

PRODUCES = 1 << 30
"""Bit of 1005h: this node is the producer."""

USUAL_COB_ID = 0x080
"""Identifier of the SYNC in the pre-defined connection set."""

_COUNTER_MAX = 240

_MICROSECOND = 1e-6
"""Unit of 1006h and 1007h [s]."""


class SyncService:
    """What one node knows of the SYNC.

    Args:
        dictionary: holds 1005h, 1006h, 1007h and 1019h.
        timers: simulated time.
        listen: called with the CAN identifier of the SYNC, and when `plain` changes.
        produce: transmits a SYNC (CAN identifier, data), and lets this node act on it.

    Attributes:
        counter: the number in the last SYNC, 0 where SYNCs are not numbered.
        window: 1007h, time after a SYNC in which synchronous RPDOs are taken [s], 0 for any time.
    """

    def __init__(
        self,
        dictionary: Dictionary,
        timers: Timers,
        listen: Callable[[int], None],
        produce: Callable[[int, bytes], None],
    ) -> None:
        self._dictionary = dictionary
        self._timers = timers
        self._listen = listen
        self._produce = produce
        self._timer: Timer | None = None
        self._running = False
        self._cob_id = 0
        self._period = 0
        self._overflow = 0
        self._misfit = False
        self._seen_at = 0.0
        self.counter = 0
        self.window = 0.0
        dictionary.on_write(0x1007, 0, self._write_window)
        dictionary.on_write(0x1005, 0, self._write_cob_id)
        dictionary.on_write(0x1006, 0, self._write_period)
        dictionary.on_write(0x1019, 0, self._write_overflow)

    @property
    def plain(self) -> bool:
        """SYNCs carry no number, the last one did not either, no window begins: nothing about them needs a look."""
        return not self._overflow and not self._misfit and not self.window

    @property
    def window_closed(self) -> bool:
        """The synchronous window of the last SYNC is over (1007h)."""
        return self._timers.now - self._seen_at > self.window > 0.0

    def reset(self) -> None:
        """Take everything from the dictionary."""
        read = self._dictionary.value
        self._cob_id = read(0x1005, default=USUAL_COB_ID)
        self._period, self._overflow = read(0x1006, default=0), read(0x1019, default=0)
        self.window = read(0x1007, default=0) * _MICROSECOND
        self._seen_at = self._timers.now
        self.counter = 0
        self._misfit = False
        self._listen(self._cob_id & IDENTIFIER)

    def run(self, running: bool) -> None:
        """Produce or not, as the NMT state allows."""
        if running is not self._running:
            self._running = running
            self._restart()

    def accepts(self, data: bytes) -> bool:
        """Whether a SYNC has the length that it should have; takes its number."""
        misfit = len(data) != (1 if self._overflow else 0)
        if misfit is not self._misfit:
            self._misfit = misfit
            self._listen(self._cob_id & IDENTIFIER)
        if not misfit:
            self.counter = data[0] if data else 0
            self._seen_at = self._timers.now
        return not misfit

    def _restart(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._running and self._cob_id & PRODUCES and self._period:
            self._timer = self._timers.after(self._period * _MICROSECOND, self._send)

    def _send(self) -> None:
        self._timer = self._timers.after(self._period * _MICROSECOND, self._send)
        following = self.counter % self._overflow + 1 if self._overflow else 0
        self._produce(self._cob_id & IDENTIFIER, bytes((following,)) if following else b"")

    def _write_cob_id(self, value: int) -> None:
        check_cob_id(value)
        # The identifier of a producer must not change while it produces.
        check_change(self._cob_id, value, switch=PRODUCES, off=False)
        started = bool(value & PRODUCES and not self._cob_id & PRODUCES)
        self._cob_id = value
        if started:
            self.counter = 0
        self._listen(value & IDENTIFIER)
        self._restart()

    def _write_period(self, value: int) -> None:
        self._period = value
        self._restart()

    def _write_window(self, value: int) -> None:
        self.window = value * _MICROSECOND
        self._seen_at = self._timers.now
        self._listen(self._cob_id & IDENTIFIER)

    def _write_overflow(self, value: int) -> None:
        if self._period:
            raise AbortError(AbortCode.DEVICE_STATE)
        if value == 1 or value > _COUNTER_MAX:
            raise AbortError(AbortCode.VALUE_RANGE_EXCEEDED)
        self._overflow = value
        self.counter = 0
        self._listen(self._cob_id & IDENTIFIER)

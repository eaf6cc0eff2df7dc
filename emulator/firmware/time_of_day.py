"""TIME consumer: 1012h, and the clock that it sets, 2010h (CiA 301, 7.2.6)."""

from __future__ import annotations

import struct

from emulator.firmware.cob_ids import IDENTIFIER, check_change, check_cob_id
from emulator.firmware.dictionary import AbortCode, AbortError, Dictionary
from emulator.firmware.nodebus import NodeBus
from emulator.firmware.timers import Timers

CONSUMES = 1 << 31
"""Bit of 1012h: this node takes TIME messages."""

PRODUCES = 1 << 30
"""Bit of 1012h: this node sends TIME messages, which these nodes do not."""

USUAL_COB_ID = 0x100
"""Identifier of TIME in the pre-defined connection set."""

_DAY = 86_400_000
"""[ms]."""

_MILLISECONDS = (1 << 28) - 1
"""Bits of the first four bytes that are milliseconds; the others are reserved."""

_SIZE = 6


class TimeOfDay:
    """The clock of a node: milliseconds after midnight, and days since 1 January 1984.

    It starts with zero at power-on, is set by TIME messages in *pre-operational* and *operational*, and goes on by
    the time of the node.

    Args:
        dictionary: holds 1012h and 2010h.
        timers: simulated time.
        bus: where TIME messages come from.
    """

    def __init__(self, dictionary: Dictionary, timers: Timers, bus: NodeBus) -> None:
        self._dictionary = dictionary
        self._timers = timers
        self._bus = bus
        self._heard: int | None = None
        self._zero = 0.0
        self._running = False
        dictionary.on_write(0x1012, 0, self._write_cob_id)
        dictionary.on_read(0x2010, 1, lambda: (self._milliseconds() // _DAY) & 0xFFFF)
        dictionary.on_read(0x2010, 2, lambda: self._milliseconds() % _DAY)

    def reset(self) -> None:
        """Take the identifier from the dictionary; the clock goes on."""
        self._listen(self._dictionary.value(0x1012, default=USUAL_COB_ID))

    def restart(self) -> None:
        """Power-on: the clock is at zero."""
        self._zero = self._timers.now

    def run(self, running: bool) -> None:
        """Take TIME messages or not, as the NMT state allows."""
        self._running = running

    def _milliseconds(self) -> int:
        return int((self._timers.now - self._zero) * 1e3 + 1e-6)

    def _receive(self, _can_id: int, data: bytes) -> None:
        if not self._running or len(data) != _SIZE:
            return
        milliseconds, days = struct.unpack("<IH", data)
        milliseconds &= _MILLISECONDS
        if milliseconds < _DAY:
            self._zero = self._timers.now - (days * _DAY + milliseconds) * 1e-3

    def _listen(self, cob_id: int) -> None:
        if self._heard is not None:
            self._bus.unsubscribe(self._heard, self._receive)
            self._heard = None
        if cob_id & CONSUMES:
            self._heard = cob_id & IDENTIFIER
            self._bus.subscribe(self._heard, self._receive)

    def _write_cob_id(self, value: int) -> None:
        if value & PRODUCES:
            raise AbortError(AbortCode.VALUE_RANGE_EXCEEDED)
        check_cob_id(value)
        check_change(self._dictionary.value(0x1012), value, switch=CONSUMES, off=False)
        self._listen(value)

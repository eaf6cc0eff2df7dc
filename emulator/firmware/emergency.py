"""Emergency producer: error register 1001h, error history 1003h, EMCY message (CiA 301, 7.2.7)."""

from __future__ import annotations

import struct
from collections.abc import Callable
from enum import IntEnum, IntFlag

from emulator.firmware.dictionary import AbortCode, AbortError, Dictionary

_HISTORY = 8


class ErrorCode(IntEnum):
    """Emergency error codes (CiA 301, table 26; CiA 402)."""

    NONE = 0x0000
    HEARTBEAT = 0x8130
    BUS_OFF_RECOVERED = 0x8140
    PDO_LENGTH = 0x8210
    PDO_TOO_LONG = 0x8220


class ErrorRegister(IntFlag):
    """Bits of object 1001h."""

    NONE = 0
    GENERIC = 0x01
    COMMUNICATION = 0x10


class Emergency:
    """Reports errors and their end.

    Args:
        dictionary: holds 1001h, 1003h and 1014h.
        send: transmits an EMCY message where the NMT state allows it.
    """

    def __init__(self, dictionary: Dictionary, send: Callable[[int, bytes], None]) -> None:
        self._dictionary = dictionary
        self._send = send
        dictionary.on_write(0x1003, 0, self._clear_history)

    def report(self, code: int, register: ErrorRegister) -> None:
        """Enter an error into register and history, and send it."""
        value = self._dictionary.value(0x1001) | register | ErrorRegister.GENERIC
        self._dictionary.set(0x1001, 0, value)
        history = [code] + [self._dictionary.value(0x1003, k) for k in range(1, self._count() + 1)]
        self._store_history(history[:_HISTORY])
        self._transmit(code, value)

    def clear(self) -> None:
        """The device is free of errors: clear the register and send "error reset"."""
        self._dictionary.set(0x1001, 0, ErrorRegister.NONE)
        self._transmit(ErrorCode.NONE, ErrorRegister.NONE)

    def _transmit(self, code: int, register: int) -> None:
        self._send(self._dictionary.value(0x1014) & 0x7FF, struct.pack("<HB5x", code, register))

    def _count(self) -> int:
        return self._dictionary.value(0x1003, 0)

    def _store_history(self, codes: list[int]) -> None:
        self._dictionary.set(0x1003, 0, len(codes))
        for k, code in enumerate(codes, start=1):
            self._dictionary.set(0x1003, k, code)

    def _clear_history(self, count: int) -> None:
        if count != 0:
            raise AbortError(AbortCode.VALUE_RANGE_EXCEEDED)
        for k in range(1, _HISTORY + 1):
            self._dictionary.set(0x1003, k, 0)

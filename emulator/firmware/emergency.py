"""Emergency producer: error register 1001h, history 1003h, EMCY 1014h, inhibit time 1015h (CiA 301, 7.2.7)."""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable
from enum import IntEnum, IntFlag

from emulator.firmware.cob_ids import INVALID, NO_REMOTE, check_change, check_cob_id
from emulator.firmware.dictionary import AbortCode, AbortError, Dictionary
from emulator.firmware.timers import Timers

_HISTORY = 8

_QUEUE = 32
"""Messages that may wait for the inhibit time; older ones are lost, as in a device of finite memory."""

_INHIBIT_UNIT = 1e-4
"""Unit of 1015h [s]."""


class ErrorCode(IntEnum):
    """Emergency error codes (CiA 301, table 26; CiA 402-2, table 7)."""

    NONE = 0x0000
    OVER_CURRENT = 0x2310
    OVER_VOLTAGE = 0x3210
    UNDER_VOLTAGE = 0x3220
    OVER_TEMPERATURE = 0x4310
    MOTOR_BLOCKED = 0x7121
    ENCODER = 0x7305
    CAN_OVERRUN = 0x8110
    CAN_PASSIVE = 0x8120
    HEARTBEAT = 0x8130
    BUS_OFF_RECOVERED = 0x8140
    PDO_LENGTH = 0x8210
    PDO_TOO_LONG = 0x8220
    SYNC_LENGTH = 0x8240
    RPDO_TIMEOUT = 0x8250
    FOLLOWING_ERROR = 0x8611
    EXTERNAL = 0x9000


class ErrorRegister(IntFlag):
    """Bits of object 1001h."""

    NONE = 0
    GENERIC = 0x01
    CURRENT = 0x02
    VOLTAGE = 0x04
    TEMPERATURE = 0x08
    COMMUNICATION = 0x10
    DEVICE_PROFILE = 0x20
    MANUFACTURER = 0x80


class Emergency:
    """Reports errors when they come and when they go; an error that stays is reported once.

    Args:
        dictionary: holds 1001h, 1003h, 1014h and 1015h.
        timers: simulated time, for the inhibit time.
        node_id: for the identifier of the pre-defined connection set.
        send: transmits an EMCY message where the NMT state allows it.
    """

    def __init__(
        self, dictionary: Dictionary, timers: Timers, node_id: int, send: Callable[[int, bytes], None]
    ) -> None:
        self._dictionary = dictionary
        self._usual_cob_id = 0x080 + node_id
        self._timers = timers
        self._send = send
        self._device: dict[int, ErrorRegister] = {}
        self._communication: dict[int, set[int]] = {}
        self._history: deque[int] = deque(maxlen=_HISTORY)
        self._waiting: deque[bytes] = deque(maxlen=_QUEUE)
        self._inhibited = False
        dictionary.on_read(0x1001, 0, self.register)
        dictionary.on_read(0x1003, 0, lambda: len(self._history))
        for k in range(1, _HISTORY + 1):
            dictionary.on_read(0x1003, k, self._history_reader(k - 1))
        dictionary.on_write(0x1003, 0, self._clear_history)
        dictionary.on_write(0x1014, 0, self._write_cob_id)

    def reset(self) -> None:
        """No error, no history, nothing waiting."""
        self._device.clear()
        self._communication.clear()
        self._history.clear()
        self._waiting.clear()

    def reset_communication(self) -> None:
        """The communication starts afresh, without errors; those of the device and the history stay."""
        self._communication.clear()

    def register(self) -> int:
        """Object 1001h."""
        value = ErrorRegister.NONE
        for bits in self._device.values():
            value |= bits | ErrorRegister.GENERIC
        if self._communication:
            value |= ErrorRegister.COMMUNICATION | ErrorRegister.GENERIC
        return int(value)

    def report(self, code: int, register: ErrorRegister, information: int = 0) -> None:
        """Enter an error of the device into register and history, and send it; once, as long as it stays.

        Args:
            code: emergency error code.
            register: bits of 1001h that it sets, beside the generic one.
            information: 16 bits for the upper half of 1003h and bytes 3 and 4 of the message.
        """
        known = code in self._device or code in self._communication
        self._device[code] = self._device.get(code, ErrorRegister.NONE) | register
        self._announce(known, code, information)

    def clear(self) -> None:
        """The device is free of errors of its own: clear them and send "error reset"."""
        self._device.clear()
        self._transmit(ErrorCode.NONE, 0)

    def report_communication(self, code: int, information: int = 0) -> None:
        """Enter an error of the communication likewise; every `information` (a node, a PDO) is an error of its own."""
        sources = self._communication.setdefault(code, set())
        known = code in self._device or information in sources
        sources.add(information)
        self._announce(known, code, information)

    def end_communication(self, code: int, information: int | None = None) -> None:
        """An error of the communication is over, for one source or for all; what the device has as its own stays."""
        sources = self._communication.get(code, set())
        if information is not None and sources - {information}:
            sources.discard(information)
        elif information is None or information in sources:
            self._forget_communication(code)

    def _forget_communication(self, code: int) -> None:
        if self._communication.pop(code, None) is not None and code not in self._device:
            self._transmit(ErrorCode.NONE, 0)

    def _announce(self, known: bool, code: int, information: int) -> None:
        if not known:
            self._history.appendleft(code | information << 16)
            self._transmit(code, information)

    def _transmit(self, code: int, information: int) -> None:
        self._waiting.append(struct.pack("<HBH3x", code, self.register(), information))
        if not self._inhibited:
            self._send_next()

    def _send_next(self) -> None:
        self._inhibited = False
        if not self._waiting:
            return
        data = self._waiting.popleft()
        cob_id = self._cob_id()
        if not cob_id & INVALID:
            self._send(cob_id & 0x7FF, data)
        inhibit = self._dictionary.value(0x1015, default=0)
        if inhibit:
            self._inhibited = True
            self._timers.after(inhibit * _INHIBIT_UNIT, self._send_next)
        else:
            self._send_next()

    def _history_reader(self, position: int) -> Callable[[], int]:
        def read() -> int:
            if position >= len(self._history):
                raise AbortError(AbortCode.NO_DATA)
            return self._history[position]

        return read

    def _clear_history(self, count: int) -> None:
        if count != 0:
            raise AbortError(AbortCode.VALUE_RANGE_EXCEEDED)
        self._history.clear()

    def _write_cob_id(self, value: int) -> None:
        if value & NO_REMOTE:
            raise AbortError(AbortCode.VALUE_RANGE_EXCEEDED)
        check_cob_id(value)
        check_change(self._cob_id(), value)

    def _cob_id(self) -> int:
        return self._dictionary.value(0x1014, default=self._usual_cob_id)

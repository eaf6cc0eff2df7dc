"""Encoder profile CiA 406: scaled absolute position with preset, code sequence, speed, cyclic timer."""

from __future__ import annotations

from collections.abc import Callable

from emulator.firmware.dictionary import AbortCode, AbortError
from emulator.firmware.hardware import EncoderHardware
from emulator.firmware.nmt import NmtState
from emulator.firmware.node import Node

_COUNTER_CLOCKWISE = 1 << 0
_SCALING_ENABLED = 1 << 2
_SUPPORTED = _COUNTER_CLOCKWISE | _SCALING_ENABLED
"""Bits of 6000h."""

_SYNC_PAUSE = 0.05
"""Time without a SYNC after which the speed is measured from reading to reading [s]."""

_SPEED_LIMIT = 32767
"""Range of 6030h, signed 16 bits [units / s]."""


class EncoderApplication:
    """The firmware of one absolute encoder.

    Args:
        node: its CANopen services.
        hardware: the code disc.
    """

    def __init__(self, node: Node, hardware: EncoderHardware) -> None:
        self._node = node
        self._hardware = hardware
        self._offset = 0
        self._units = self._range = hardware.counts_per_revolution
        self._operating = _SCALING_ENABLED
        self._last: tuple[float, int] | None = None
        self._speed = 0
        self._bind()

    def reset(self) -> None:
        """Power-on values: the physical resolution, no offset."""
        read = self._node.object_dictionary.value
        self._operating = read(0x6000)
        self._units = read(0x6001)
        self._range = read(0x6002)
        self._offset = 0
        self._last = None
        self._speed = 0

    def nmt_changed(self, state: NmtState) -> None:
        """Nothing depends on it."""

    def rpdo_applied(self) -> None:
        """An encoder has no RPDO."""

    def rpdo_missing(self) -> None:
        """An encoder has no RPDO."""

    def connection_lost(self) -> None:
        """Nothing moves by itself that would have to stop."""

    def sample(self) -> None:
        """Speed is the change of position from SYNC to SYNC; without SYNCs, from reading to reading."""
        now = self._node.timers.now
        if self._last is None:
            self._last = now, self._position()
        elif now > self._last[0]:
            position = self._position()
            modulus = self._modulus()
            moved = (position - self._last[1] + modulus // 2) % modulus - modulus // 2
            self._speed = round(moved / (now - self._last[0]))
            self._last = now, position

    def _bind(self) -> None:
        objects = self._node.object_dictionary
        counts = self._hardware.counts_per_revolution
        reads: dict[tuple[int, int], Callable[[], int]] = {
            (0x6004, 0): self._position,
            (0x6030, 1): self._measured_speed,
            (0x6500, 0): lambda: self._operating,
            (0x6501, 0): lambda: counts,
            (0x6509, 0): lambda: self._offset,
            (0x650A, 3): lambda: counts - 1,
        }
        for (index, subindex), read in reads.items():
            objects.on_read(index, subindex, read)
        writes: dict[int, Callable[[int], None]] = {
            0x6000: self._write_operating,
            0x6001: self._write_units,
            0x6002: self._write_range,
            0x6003: self._preset,
            0x6200: self._write_cyclic_timer,
        }
        for index, write in writes.items():
            objects.on_write(index, 0, write)

    def _scaled(self) -> int:
        counts = self._hardware.counts_per_revolution
        position = self._hardware.position() % counts
        if self._operating & _COUNTER_CLOCKWISE:
            position = -position % counts
        if self._operating & _SCALING_ENABLED:
            position = position * self._units // counts
        return position

    def _modulus(self) -> int:
        """Where the position value starts again at zero."""
        return self._range if self._operating & _SCALING_ENABLED else self._hardware.counts_per_revolution

    def _position(self) -> int:
        return (self._scaled() + self._offset) % self._modulus()

    def _measured_speed(self) -> int:
        if self._last is None or self._node.timers.now - self._last[0] > _SYNC_PAUSE:
            self.sample()
        return max(-_SPEED_LIMIT, min(self._speed, _SPEED_LIMIT))

    def _write_operating(self, value: int) -> None:
        if value & ~_SUPPORTED:
            raise AbortError(AbortCode.VALUE_RANGE_EXCEEDED)
        self._operating = value
        self._last = None

    def _write_units(self, value: int) -> None:
        self._refuse_beyond(value, self._hardware.counts_per_revolution)
        self._units = value
        self._last = None

    def _write_range(self, value: int) -> None:
        self._refuse_beyond(value, self._hardware.counts_per_revolution)
        self._range = value
        self._last = None

    def _preset(self, value: int) -> None:
        self._refuse_beyond(value, self._modulus() - 1)
        self._offset = value - self._scaled()
        self._last = None

    def _refuse_beyond(self, value: int, limit: int) -> None:
        if value > limit:
            raise AbortError(AbortCode.VALUE_TOO_HIGH)

    def _write_cyclic_timer(self, value: int) -> None:
        # 6200h is the event timer of the first TPDO under another name (CiA 406).
        self._node.object_dictionary.write(0x1800, 5, value, downloaded=True)

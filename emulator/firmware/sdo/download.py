"""SDO download, client to server: segments (CiA 301, 7.2.4.3.4) and blocks (7.2.4.3.9 to 7.2.4.3.11)."""

from __future__ import annotations

from binascii import crc_hqx

from emulator.firmware.dictionary import AbortCode, AbortError
from emulator.firmware.sdo.transfer import BLOCK_SIZE, FRAME_SIZE, SEGMENT_SIZE, Multiplexor, Send, Target

_LAST_SEGMENT = 0x01
_TOGGLE = 0x10
_LAST_OF_BLOCKS = 0x80
_END_OF_BLOCKS = 0xC1
_END_MASK = 0xE1


class SegmentedDownload:
    """Takes segments of up to seven bytes, each confirmed.

    Args:
        multiplexor: the object.
        target: takes the data.
        send: sends a frame to the client.
    """

    takes_all = False

    def __init__(self, multiplexor: Multiplexor, target: Target, send: Send) -> None:
        self.multiplexor = multiplexor
        self._target = target
        self._send = send
        self._data = bytearray()
        self._toggle = 0
        send(multiplexor.frame(0x60))

    def receive(self, frame: bytes) -> bool:
        """Take a segment; True with the last one.

        Raises:
            AbortError: not a segment, wrong toggle bit, or refused data.
        """
        if frame[0] >> 5 != 0:
            raise AbortError(AbortCode.COMMAND_SPECIFIER)
        if frame[0] & _TOGGLE != self._toggle:
            raise AbortError(AbortCode.TOGGLE_BIT)
        unused = frame[0] >> 1 & 0x07
        self._data += frame[1 : FRAME_SIZE - unused]
        self._target.refuse_longer(len(self._data))
        last = bool(frame[0] & _LAST_SEGMENT)
        if last:
            self._target.write(bytes(self._data))
        self._send(bytes((0x20 | self._toggle,)).ljust(FRAME_SIZE, b"\x00"))
        self._toggle ^= _TOGGLE
        return last


class BlockDownload:
    """Takes blocks of segments, each block confirmed with the last segment that came in order.

    Args:
        multiplexor: the object.
        target: takes the data.
        checked: the client sends a checksum.
        send: sends a frame to the client.
    """

    def __init__(self, multiplexor: Multiplexor, target: Target, checked: bool, send: Send) -> None:
        self.multiplexor = multiplexor
        self._target = target
        self._checked = checked
        self._send = send
        self._data = bytearray()
        self._received = 0
        self._complete = False
        send(multiplexor.frame(0xA4, bytes((BLOCK_SIZE,))))

    @property
    def takes_all(self) -> bool:
        """Until the last segment has come, every frame is a segment."""
        return not self._complete

    def receive(self, frame: bytes) -> bool:
        """Take a segment, or the end of the transfer; True with the end.

        Raises:
            AbortError: wrong sequence number, command, checksum or length, or refused data.
        """
        if self._complete:
            self._finish(frame)
            return True
        self._take_segment(frame[0] & ~_LAST_OF_BLOCKS, bool(frame[0] & _LAST_OF_BLOCKS), frame[1:])
        return False

    def _take_segment(self, number: int, last: bool, data: bytes) -> None:
        if number == 0:
            raise AbortError(AbortCode.SEQUENCE_NUMBER)
        in_order = number == self._received + 1
        if in_order:
            self._received = number
            self._data += data
            # The last segment may carry up to seven bytes more than the object: `n` of the end says how many.
            self._target.refuse_longer(max(len(self._data) - SEGMENT_SIZE, 0))
            self._complete = last
        # What follows a lost segment is not used; the client sends it again after this confirmation.
        if last or number == BLOCK_SIZE:
            self._send(bytes((0xA2, self._received, BLOCK_SIZE)).ljust(FRAME_SIZE, b"\x00"))
            self._received = 0

    def _finish(self, frame: bytes) -> None:
        if frame[0] & _END_MASK != _END_OF_BLOCKS:
            raise AbortError(AbortCode.COMMAND_SPECIFIER)
        unused = frame[0] >> 2 & 0x07
        data = bytes(self._data[: len(self._data) - unused])
        if self._checked and crc_hqx(data, 0) != int.from_bytes(frame[1:3], "little"):
            raise AbortError(AbortCode.CHECKSUM)
        self._target.write(data)
        self._send(b"\xa1".ljust(FRAME_SIZE, b"\x00"))

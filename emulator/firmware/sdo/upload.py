"""SDO upload, server to client: segments (CiA 301, 7.2.4.3.6) and blocks (7.2.4.3.13 to 7.2.4.3.15)."""

from __future__ import annotations

from binascii import crc_hqx
from enum import Enum, auto

from emulator.firmware.dictionary import AbortCode, AbortError
from emulator.firmware.sdo.transfer import BLOCK_SIZE, FRAME_SIZE, SEGMENT_SIZE, Multiplexor, Send

_TOGGLE = 0x10
_UPLOAD_SEGMENT = 3
_BLOCK_UPLOAD = 5
_END, _ACKNOWLEDGE, _START = 1, 2, 3
"""Client sub-commands of a block upload."""


class SegmentedUpload:
    """Gives up to seven bytes a request.

    Args:
        multiplexor: the object.
        data: its value.
        send: sends a frame to the client.
    """

    takes_all = False

    def __init__(self, multiplexor: Multiplexor, data: bytes, send: Send) -> None:
        self.multiplexor = multiplexor
        self._data = memoryview(data)
        self._send = send
        self._toggle = 0
        send(multiplexor.frame(0x41, len(data).to_bytes(4, "little")))

    def receive(self, frame: bytes) -> bool:
        """Answer a request with the next segment; True with the last one.

        Raises:
            AbortError: another request, or a wrong toggle bit.
        """
        if frame[0] >> 5 != _UPLOAD_SEGMENT:
            raise AbortError(AbortCode.COMMAND_SPECIFIER)
        if frame[0] & _TOGGLE != self._toggle:
            raise AbortError(AbortCode.TOGGLE_BIT)
        segment, self._data = bytes(self._data[:SEGMENT_SIZE]), self._data[SEGMENT_SIZE:]
        last = not self._data
        command = self._toggle | (SEGMENT_SIZE - len(segment)) << 1 | last
        self._send(bytes((command,)) + segment.ljust(SEGMENT_SIZE, b"\x00"))
        self._toggle ^= _TOGGLE
        return last


class _Phase(Enum):
    ANNOUNCED = auto()
    BLOCKS = auto()
    ENDING = auto()


class BlockUpload:
    """Gives blocks of segments; what the client has not confirmed is sent again.

    Args:
        multiplexor: the object.
        data: its value.
        size: segments in a block that the client asks for.
        checked: the client wants a checksum.
        send: sends a frame to the client.

    Raises:
        AbortError: 0504 0002h.
    """

    takes_all = False

    def __init__(self, multiplexor: Multiplexor, data: bytes, size: int, checked: bool, send: Send) -> None:
        self.multiplexor = multiplexor
        self._data = data
        self._size = _check_size(size)
        self._checked = checked
        self._send = send
        self._phase = _Phase.ANNOUNCED
        self._confirmed = 0
        self._sent = 0
        send(multiplexor.frame(0xC6, len(data).to_bytes(4, "little")))

    def receive(self, frame: bytes) -> bool:
        """Answer the client's start, confirmation of a block, or end; True with the end.

        Raises:
            AbortError: another command than fits now, a wrong block size or sequence number.
        """
        if frame[0] >> 5 != _BLOCK_UPLOAD:
            raise AbortError(AbortCode.COMMAND_SPECIFIER)
        command = frame[0] & 0x03
        if (self._phase, command) == (_Phase.ANNOUNCED, _START):
            self._phase = _Phase.BLOCKS
            self._send_block()
        elif (self._phase, command) == (_Phase.BLOCKS, _ACKNOWLEDGE):
            self._take_confirmation(frame[1], frame[2])
        elif (self._phase, command) == (_Phase.ENDING, _END):
            return True
        else:
            raise AbortError(AbortCode.COMMAND_SPECIFIER)
        return False

    def _take_confirmation(self, received: int, size: int) -> None:
        if received > self._sent:
            raise AbortError(AbortCode.SEQUENCE_NUMBER)
        self._size = _check_size(size)
        self._confirmed += received * SEGMENT_SIZE
        # Data without a byte still take one, empty segment.
        if received and self._confirmed >= len(self._data):
            self._phase = _Phase.ENDING
            self._send_end()
        else:
            self._send_block()

    def _send_block(self) -> None:
        block = self._data[self._confirmed : self._confirmed + self._size * SEGMENT_SIZE]
        final = self._confirmed + len(block) >= len(self._data)
        segments = [block[k : k + SEGMENT_SIZE] for k in range(0, len(block), SEGMENT_SIZE)] or [b""]
        self._sent = len(segments)
        for number, segment in enumerate(segments, start=1):
            last = final and number == self._sent
            self._send(bytes((number | last << 7,)) + segment.ljust(SEGMENT_SIZE, b"\x00"))

    def _send_end(self) -> None:
        unused = -len(self._data) % SEGMENT_SIZE if self._data else SEGMENT_SIZE
        checksum = crc_hqx(self._data, 0) if self._checked else 0
        self._send((bytes((0xC1 | unused << 2,)) + checksum.to_bytes(2, "little")).ljust(FRAME_SIZE, b"\x00"))


def _check_size(size: int) -> int:
    if not 1 <= size <= BLOCK_SIZE:
        raise AbortError(AbortCode.BLOCK_SIZE)
    return size

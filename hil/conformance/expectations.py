"""When an answer counts as that of the trace: what the protocol fixes is compared, what the device puts in is not."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import Enum, auto

from hil.network.cia import SDO_ABORT

UPLOADED = 2
"""Server command specifier (upper three bits) of the answer to an upload request."""

OBJECT_MISSING, SUBINDEX_MISSING = 0x06020000, 0x06090011

_ON_REMOTE = 253
"""Transmission type that the device of the trace refuses, and others may have."""

_HISTORY = 0x1003

_EXACT_OBJECTS = frozenset((0x1005, 0x1006, 0x1014, 0x1015, 0x1017, 0x1019, 0x1200, 0x1400, 0x1800))
"""Objects whose values CiA 301 or the trace itself fixes; the values of others are the device's own."""

_OWN_ENTRIES = frozenset(((0x1800, 3),))
"""Entries of those objects whose default is the manufacturer's: the inhibit time (CiA 301, 7.5.2.37)."""

_SEGMENT, _BLOCK_END = 0xF1, 0xE3
"""What must agree in the first byte: command and toggle, not the number of unused bytes."""

_DOWNLOADED, _BLOCK_UPLOADED = 0x60, 6


class Answer(Enum):
    """What an SDO answer can be, by the request before it."""

    PLAIN = auto()
    SEGMENT = auto()
    BLOCK = auto()


@dataclass(frozen=True)
class SdoExpectation:
    """What the node must answer.

    Attributes:
        request: the frame of the client.
        answer: what the device of the trace answered.
        abort_codes: abort codes that will do instead of that in `answer`.
    """

    request: bytes
    answer: bytes
    abort_codes: frozenset[int]

    def met_by(self, answer: bytes) -> bool:
        """Whether this answer will do."""
        kind = _kind(self.request)
        if answer == self.answer:
            return True
        if self.answer[0] == SDO_ABORT:
            allowed = self.abort_codes | {abort_code(self.answer)}
            return (answer[0] == SDO_ABORT and abort_code(answer) in allowed) or self._has_more(answer)
        if kind is Answer.SEGMENT:
            return _agree(answer, self.answer, _SEGMENT)
        if kind is Answer.BLOCK:
            return _agree(answer, self.answer, _BLOCK_END if self.answer[0] >> 5 == _BLOCK_UPLOADED else 0xFF)
        return self._same_object_with_its_own_value(answer)

    def decided_by(self, answer: bytes) -> bool:
        """Whether a download has been answered at all, taken or refused."""
        return self.request[0] >> 5 == 1 and answer[0] in (_DOWNLOADED, SDO_ABORT)

    def _same_object_with_its_own_value(self, answer: bytes) -> bool:
        index, subindex = struct.unpack_from("<HB", self.answer, 1)
        if index == _HISTORY:
            # The upper half of an entry is the device's own.
            return answer[:6] == self.answer[:6]
        uploads = {answer[0] >> 5, self.answer[0] >> 5} <= {UPLOADED, _BLOCK_UPLOADED}
        own = index not in _EXACT_OBJECTS or (index, subindex) in _OWN_ENTRIES
        return uploads and answer[1:4] == self.answer[1:4] and own

    def _has_more(self, answer: bytes) -> bool:
        """The node has what the device of the trace has not: TPDOs on remote request."""
        written = self.request[2] == 0x18 and self.request[3] == 2 and self.request[4] == _ON_REMOTE
        return written and answer[0] == _DOWNLOADED


def _kind(request: bytes) -> Answer:
    command = request[0] >> 5
    if command == 3:
        return Answer.SEGMENT
    return Answer.BLOCK if command == 5 and request[0] & 0x03 else Answer.PLAIN


def _agree(answer: bytes, expected: bytes, mask: int) -> bool:
    return answer[0] & mask == expected[0] & mask


def abort_code(frame: bytes) -> int:
    """The code in an abort."""
    return int(struct.unpack_from("<I", frame, 4)[0])

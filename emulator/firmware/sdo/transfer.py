"""What every SDO transfer is made of: multiplexor, frames, and what may be transferred to an object."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from durand.datatypes import is_numeric

from emulator.firmware.dictionary import AbortCode, AbortError, Dictionary

FRAME_SIZE = 8
SEGMENT_SIZE = 7
BLOCK_SIZE = 127
"""Segments that one block may have at most."""

LONGEST_TEXT = 256
"""Bytes that an object without a fixed size can take: the memory of the device."""

Send = Callable[[bytes], None]


@dataclass(frozen=True)
class Multiplexor:
    """Index and sub-index of the object that a transfer is about."""

    index: int
    subindex: int

    def frame(self, command: int, tail: bytes = b"") -> bytes:
        """A frame of 8 bytes: command specifier, multiplexor, and up to four more bytes."""
        return struct.pack("<BHB", command, self.index, self.subindex) + tail.ljust(4, b"\x00")


class Transfer(Protocol):
    """A transfer that takes more than one request."""

    @property
    def multiplexor(self) -> Multiplexor:
        """The object that it is about."""

    @property
    def takes_all(self) -> bool:
        """Frames are segments now, whatever their first byte looks like."""

    def receive(self, frame: bytes) -> bool:
        """Take a frame of the client and answer it; True when the transfer is over.

        Raises:
            AbortError: the transfer ends here.
        """


class Target:
    """An object that is being written: which sizes and values it takes.

    Args:
        dictionary: the object dictionary.
        multiplexor: the object.
        size: number of bytes that the client has announced, if it has.

    Raises:
        AbortError: there is no such object, it cannot be written, or it never has this size.
    """

    def __init__(self, dictionary: Dictionary, multiplexor: Multiplexor, size: int | None) -> None:
        self._dictionary = dictionary
        self._key = (multiplexor.index, multiplexor.subindex)
        self._variable = dictionary.find(*self._key)
        self._announced = size
        if not self._variable.writable:
            raise AbortError(AbortCode.READ_ONLY)
        if size is not None:
            self.refuse_longer(size)
            self._refuse_shorter(size)

    @property
    def size(self) -> int | None:
        """Bytes that the object has, None where that varies."""
        size: int | None = self._variable.size
        return size

    def refuse_longer(self, size: int) -> None:
        """Stop a transfer that is already longer than the object."""
        if size > (LONGEST_TEXT if self.size is None else self.size):
            raise AbortError(AbortCode.TOO_LONG)

    def write(self, data: bytes) -> None:
        """Put the complete data into the object dictionary.

        Raises:
            AbortError: wrong length, out of range, or refused by the application.
        """
        self.refuse_longer(len(data))
        self._refuse_shorter(len(data))
        if self._announced is not None and self._announced != len(data):
            raise AbortError(AbortCode.LENGTH_MISMATCH)
        value = self._variable.unpack(data)
        self._dictionary.check(*self._key, value)
        self._dictionary.write(*self._key, value, downloaded=True)

    def _refuse_shorter(self, size: int) -> None:
        if self.size is not None and size < self.size:
            raise AbortError(AbortCode.TOO_SHORT)


def read_object(dictionary: Dictionary, multiplexor: Multiplexor) -> bytes:
    """The bytes of an object as an SDO carries them.

    Raises:
        AbortError: there is no such object, it cannot be read, or it has no data now.
    """
    key = (multiplexor.index, multiplexor.subindex)
    variable = dictionary.find(*key)
    if not variable.readable:
        raise AbortError(AbortCode.WRITE_ONLY)
    value: Any = dictionary.read(*key)
    data: bytes = variable.pack(value) if is_numeric(variable.datatype) else bytes(value)
    return data

"""Who listens to a bus, and what has passed one that nobody simulates: frames by their length, which says its load."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from hil.bus.bit_length import UNSTUFFED_TAIL_BITS, longest_frame_bits

_LONGEST: Final = 8
_HEADER_AND_CRC: Final = 19 + 15
_LEAST: Final = tuple(_HEADER_AND_CRC + 8 * length + UNSTUFFED_TAIL_BITS for length in range(_LONGEST + 1))
_MOST: Final = tuple(longest_frame_bits(length) for length in range(_LONGEST + 1))


Hear = Callable[[int, bytes], None]
"""Called with identifier, with the flags of `can_frame`, and data of a frame."""


def heard_by(listeners: Sequence[Hear]) -> Hear | None:
    """All of them as one; None where there is none."""
    if len(listeners) < 2:
        return listeners[0] if listeners else None

    def hear(can_id: int, data: bytes) -> None:
        for each in listeners:
            each(can_id, data)

    return hear


class Traffic:
    """Counts standard data frames; one costs an addition, where its stuff bits would cost a look at every byte.

    Attributes:
        by_length: frames with 0 to 8 bytes so far.
    """

    def __init__(self) -> None:
        self.by_length = [0] * (_LONGEST + 1)

    def hear(self, _can_id: int, data: bytes) -> None:
        """One frame more."""
        self.by_length[len(data)] += 1

    @property
    def frames(self) -> int:
        """All frames so far."""
        return sum(self.by_length)

    @property
    def bits(self) -> tuple[int, int]:
        """Bit times so far, without and with all stuff bits that there can be."""
        by_length = self.by_length
        return (
            sum(count * bits for count, bits in zip(by_length, _LEAST, strict=True)),
            sum(count * bits for count, bits in zip(by_length, _MOST, strict=True)),
        )

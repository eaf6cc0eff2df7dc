"""What travels over the socket of a `unix:` bus: `can_frame`s of SocketCAN, and the hello of a client.

A packet whose length is a multiple of 16 holds frames, one or, for clients that asked for it, several. Any other
length is a hello: magic, mask of the error classes wanted, flags, and the filters of SocketCAN (identifier, mask).
To clients that ask for it the hub says behind the frames of a packet how many it has dropped, from the first one on.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import can

from hil.bus.frame_kinds import ERROR_FRAME, EXTENDED, EXTENDED_MASK, REMOTE, STANDARD_MASK

FRAME: Final = struct.Struct("=IBB2x8s")
"""struct can_frame of <linux/can.h>: identifier with flags, length, a pad byte that marks own frames, data."""

FRAME_SIZE: Final = FRAME.size
OWN_MARK: Final = 1
_OWN_MARK_OFFSET: Final = 5
INVERTED: Final = 0x20000000
"""CAN_INV_FILTER: the filter lets through what does not match."""

_HELLO: Final = struct.Struct("=III")
_FILTER: Final = struct.Struct("=II")
_MAGIC: Final = 0x4E414351
_OWN_FRAMES, _JOIN_FILTERS, _ACKNOWLEDGE, _BURSTS, _DROPS = 1, 2, 4, 8, 16
ACKNOWLEDGEMENT: Final = _MAGIC.to_bytes(4, "little")
DROPS: Final = struct.Struct("=I")
"""Frames dropped so far, modulo 2^32, as the system counts them for SO_RXQ_OVFL."""


def pack_frame(message: can.Message) -> bytes:
    """A message as `can_frame`.

    Raises:
        CanOperationError: it is a CAN FD frame.
    """
    if message.is_fd:
        raise can.CanOperationError("this bus carries classic CAN frames only")
    flags = EXTENDED * message.is_extended_id | REMOTE * message.is_remote_frame | ERROR_FRAME * message.is_error_frame
    return FRAME.pack(message.arbitration_id | flags, message.dlc, 0, message.data)


def unpack_frame(packet: bytes, timestamp: float) -> can.Message:
    """A `can_frame` as message."""
    can_id, length, mark, data = FRAME.unpack(packet)
    extended, remote, error = bool(can_id & EXTENDED), bool(can_id & REMOTE), bool(can_id & ERROR_FRAME)
    return can.Message(
        timestamp=timestamp,
        arbitration_id=can_id & (EXTENDED_MASK if extended or error else STANDARD_MASK),
        is_extended_id=extended,
        is_remote_frame=remote,
        is_error_frame=error,
        is_rx=mark != OWN_MARK,
        dlc=length,
        data=bytearray(b"" if remote else data[:length]),
    )


def marked_as_own(packet: bytes) -> bytes:
    """A frame as its sender gets it back."""
    return packet[:_OWN_MARK_OFFSET] + bytes((OWN_MARK,)) + packet[_OWN_MARK_OFFSET + 1 :]


@dataclass(frozen=True)
class Hello:
    """What a client wants to hear.

    Attributes:
        filters: (identifier, mask) as in SocketCAN; an empty list lets nothing through.
        error_mask: classes of error frames.
        own_frames: its own frames too.
        join_filters: a frame must pass all filters instead of one.
        acknowledge: the hub answers, so that the client knows that it is heard of.
        bursts: several frames may come in one packet.
        drops: packets end with the number of frames dropped so far, once there are any.
    """

    filters: Sequence[tuple[int, int]] = ((0, 0),)
    error_mask: int = EXTENDED_MASK
    own_frames: bool = False
    join_filters: bool = False
    acknowledge: bool = False
    bursts: bool = False
    drops: bool = False

    @property
    def everything(self) -> bool:
        """Whether nothing is filtered."""
        return tuple(self.filters) == ((0, 0),) and self.error_mask == EXTENDED_MASK

    def pack(self) -> bytes:
        """As the hub reads it."""
        flags = _OWN_FRAMES * self.own_frames | _JOIN_FILTERS * self.join_filters
        flags |= _ACKNOWLEDGE * self.acknowledge | _BURSTS * self.bursts | _DROPS * self.drops
        return _HELLO.pack(_MAGIC, self.error_mask, flags) + b"".join(_FILTER.pack(*one) for one in self.filters)

    def passes(self, can_id: int) -> bool:
        """Whether a frame is wanted; `can_id` carries the flags of `can_frame`."""
        if can_id & ERROR_FRAME:
            return bool(can_id & self.error_mask & EXTENDED_MASK)
        matches = (
            (can_id & mask == wanted & ~INVERTED & mask) != bool(wanted & INVERTED) for wanted, mask in self.filters
        )
        return all(matches) if self.join_filters and self.filters else any(matches)


def unpack_hello(packet: bytes) -> Hello | None:
    """The hello in a packet, None if it is none."""
    if len(packet) < _HELLO.size or (len(packet) - _HELLO.size) % _FILTER.size:
        return None
    magic, error_mask, flags = _HELLO.unpack_from(packet)
    if magic != _MAGIC:
        return None
    filters = tuple(_FILTER.iter_unpack(packet[_HELLO.size :]))
    wanted = [bool(flags & flag) for flag in (_OWN_FRAMES, _JOIN_FILTERS, _ACKNOWLEDGE, _BURSTS, _DROPS)]
    return Hello(filters, error_mask, *wanted)

"""Operations of FMI-LS-BUS 1.0 for CAN as bytes (section "Network Abstraction", CAN)."""

from __future__ import annotations

import enum
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final


class OpCode(enum.IntEnum):
    """Kinds of operations."""

    FORMAT_ERROR = 0x01
    CAN_TRANSMIT = 0x10
    CONFIRM = 0x20
    ARBITRATION_LOST = 0x30
    BUS_ERROR = 0x31
    CONFIGURATION = 0x40
    STATUS = 0x41
    WAKE_UP = 0x42


class ConfigurationKind(enum.IntEnum):
    """Parameters that a network FMU tells the bus."""

    CAN_BAUD_RATE = 1
    ARBITRATION_LOST_BEHAVIOR = 4


_HEAD: Final = struct.Struct("<II")
_TRANSMIT: Final = struct.Struct("<IIIBBH")


@dataclass(frozen=True)
class Operation:
    """An operation: its code and what follows code and length."""

    code: int
    content: bytes


@dataclass(frozen=True)
class CanFrame:
    """A CAN frame: identifier, data, and whether it is extended or a remote one."""

    can_id: int
    data: bytes = b""
    extended: bool = False
    remote: bool = False


def transmit(frame: CanFrame) -> bytes:
    """A `CAN Transmit`."""
    size = _TRANSMIT.size + len(frame.data)
    head = _TRANSMIT.pack(OpCode.CAN_TRANSMIT, size, frame.can_id, frame.extended, frame.remote, len(frame.data))
    return head + frame.data


def operations(data: bytes) -> Iterator[Operation]:
    """The operations in a binary variable, in order.

    Raises:
        ValueError: they do not fill it.
    """
    while data:
        if len(data) < _HEAD.size:
            raise ValueError(f"{len(data)} bytes are left over.")
        code, size = _HEAD.unpack_from(data)
        if not _HEAD.size <= size <= len(data):
            raise ValueError(f"An operation of {size} bytes, where {len(data)} are left.")
        yield Operation(code, data[_HEAD.size : size])
        data = data[size:]


def frames(data: bytes) -> Iterator[CanFrame]:
    """The frames in a binary variable, in order; other operations are left out.

    Raises:
        ValueError: a transmission is malformed.
    """
    for operation in operations(data):
        if operation.code == OpCode.CAN_TRANSMIT:
            can_id, extended, remote, length = struct.unpack_from("<IBBH", operation.content)
            payload = operation.content[8:]
            if len(payload) != length:
                raise ValueError(f"A frame of {length} bytes with {len(payload)}.")
            yield CanFrame(can_id, payload, bool(extended), bool(remote))


def baud_rate(data: bytes) -> int | None:
    """The bit rate that a binary variable configures [bit/s], None where it does not."""
    for operation in operations(data):
        if operation.code == OpCode.CONFIGURATION and operation.content[0] == ConfigurationKind.CAN_BAUD_RATE:
            return int.from_bytes(operation.content[1:5], "little")
    return None

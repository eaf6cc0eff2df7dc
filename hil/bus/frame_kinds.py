"""Flags that SocketCAN carries in an identifier (<linux/can.h>), and classes of error frames (<linux/can/error.h>)."""

from __future__ import annotations

from typing import Final

import can

EXTENDED: Final = 0x80000000
REMOTE: Final = 0x40000000
ERROR_FRAME: Final = 0x20000000
STANDARD_MASK: Final = 0x7FF
EXTENDED_MASK: Final = 0x1FFFFFFF

PROTOCOL_ERROR: Final = 0x08


def device_frame(can_id: int, data: bytes, timestamp: float = 0.0) -> can.Message:
    """A frame of the emulated devices as message: a data frame with an 11-bit identifier, or an error frame.

    Args:
        can_id: 11-bit identifier, or an error class with `ERROR_FRAME`.
        data: payload.
        timestamp: [s].
    """
    if can_id & ERROR_FRAME:
        return can.Message(
            timestamp=timestamp, arbitration_id=can_id & ~ERROR_FRAME, is_error_frame=True, data=bytearray(data)
        )
    return can.Message(timestamp=timestamp, arbitration_id=can_id, is_extended_id=False, data=bytearray(data))

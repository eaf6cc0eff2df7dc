"""What CiA 301 says about CAN identifiers that can be changed by SDO: reserved ones, and when they may change."""

from __future__ import annotations

from emulator.firmware.dictionary import AbortCode, AbortError

INVALID = 1 << 31
"""Bit of a COB-ID of PDO or EMCY: the object does not exist."""

NO_REMOTE = 1 << 30
"""Bit of a COB-ID of a TPDO: remote frames are not answered."""

EXTENDED = 1 << 29
"""Bit of a COB-ID: 29-bit identifier, which these nodes do not have."""

IDENTIFIER = 0x1FFFFFFF
"""Bits of a COB-ID that are the CAN identifier."""

_HIGHEST = 0x7FF

_RESTRICTED = (
    (0x000, 0x000),
    (0x001, 0x07F),
    (0x101, 0x180),
    (0x581, 0x5FF),
    (0x601, 0x67F),
    (0x6E0, 0x6FF),
    (0x701, 0x7FF),
)
"""CAN identifiers that no configurable communication object may use (CiA 301, table 40)."""


def check_cob_id(value: int) -> None:
    """Refuse a COB-ID whose identifier is restricted or longer than 11 bits.

    Raises:
        AbortError: 0609 0030h.
    """
    identifier = value & IDENTIFIER
    if value & EXTENDED or identifier > _HIGHEST or any(low <= identifier <= high for low, high in _RESTRICTED):
        raise AbortError(AbortCode.VALUE_RANGE_EXCEEDED)


def check_change(present: int, value: int, switch: int = INVALID, off: bool = True) -> None:
    """Refuse another identifier while the object exists and goes on existing (CiA 301: make it invalid first).

    Args:
        present: COB-ID so far.
        value: COB-ID written.
        switch: the bit that says whether the object exists.
        off: the level of that bit at which it does not exist.

    Raises:
        AbortError: 0609 0030h.
    """
    exists = [bool(cob_id & switch) is not off for cob_id in (present, value)]
    if all(exists) and (present ^ value) & IDENTIFIER:
        raise AbortError(AbortCode.VALUE_RANGE_EXCEEDED)

"""Length of a classic CAN frame on the wire, stuff bits and intermission included (ISO 11898-1)."""

from __future__ import annotations

from functools import lru_cache

from hil.bus.frame_kinds import ERROR_FRAME

_CRC_POLYNOMIAL = 0x4599
"""x^15 + x^14 + x^10 + x^8 + x^7 + x^4 + x^3 + 1, ISO 11898-1."""

UNSTUFFED_TAIL_BITS = 1 + 2 + 7 + 3
"""CRC delimiter, acknowledge slot and delimiter, end of frame, intermission."""

ERROR_FRAME_BITS = 6 + 6 + 8 + 3
"""Longest error frame: flag, echo of the other nodes, delimiter, intermission (ISO 11898-1)."""


def _stuff_step(state: int, bit: int) -> tuple[int, int]:
    # The state is the last bit on the wire and the length of its run: bit * 5 + (run - 1).
    last, run = divmod(state, 5)
    run = run + 2 if bit == last else 1
    if run == 5:
        # A complementary bit follows five equal ones, and starts a run of its own.
        return (1 - bit) * 5, 1
    return bit * 5 + run - 1, 0


def _stuff_byte(state: int, byte: int, width: int = 8) -> tuple[int, int]:
    stuffed = 0
    for shift in range(width - 1, -1, -1):
        state, extra = _stuff_step(state, byte >> shift & 1)
        stuffed += extra
    return state, stuffed


def _crc_bits(crc: int, value: int, width: int) -> int:
    for shift in range(width - 1, -1, -1):
        feedback = (value >> shift & 1) ^ (crc >> 14 & 1)
        crc = (crc << 1 & 0x7FFF) ^ (_CRC_POLYNOMIAL if feedback else 0)
    return crc


_CRC_TABLE = tuple(_crc_bits(0, byte, 8) for byte in range(256))
_STUFFED_BYTES = tuple(_stuff_byte(state, byte) for state in range(10) for byte in range(256))
_NEXT_STATE = tuple(state << 8 for state, _ in _STUFFED_BYTES)
_STUFF_BITS = tuple(extra for _, extra in _STUFFED_BYTES)
_STUFF_BITS_OF_7 = tuple(_stuff_byte(state, bits, 7)[1] for state in range(10) for bits in range(256))
"""Indexed by (state << 8 | byte); the last one by the 7 low bits of the CRC."""


@lru_cache(maxsize=4096)
def _header(can_id: int, extended: bool, remote: bool, dlc: int) -> tuple[int, int, int]:
    """Bits of an empty frame with the header's stuff bits, stuff state << 8 and CRC after the header."""
    if extended:
        value = (can_id >> 18) << 27 | 0b11 << 25 | (can_id & 0x3FFFF) << 7 | remote << 6 | dlc
        width = 39
    else:
        value, width = can_id << 7 | remote << 6 | dlc, 19
    # The bus is idle (recessive) before the dominant start of frame, which therefore begins a run of its own.
    state, stuffed = 0, 0
    for shift in range(width - 2, -1, -1):
        state, extra = _stuff_step(state, value >> shift & 1)
        stuffed += extra
    return width + stuffed + 15 + UNSTUFFED_TAIL_BITS, state << 8, _crc_bits(0, value, width)


def longest_frame_bits(length: int) -> int:
    """Bit times of the longest standard data frame with `length` bytes: a stuff bit after 5 and then every 4 bits."""
    stuffable = 19 + 8 * length + 15
    return stuffable + (stuffable - 1) // 4 + UNSTUFFED_TAIL_BITS


def frame_bits(can_id: int, data: bytes, extended: bool = False, remote: bool = False, dlc: int = -1) -> int:
    """Bit times that a data or remote frame occupies the bus, from start of frame to end of intermission.

    Args:
        can_id: 11-bit identifier, or 29-bit where `extended`.
        data: payload, at most 8 bytes; empty for a remote frame.
        extended: 29-bit identifier.
        remote: remote frame.
        dlc: data length code; that of `data` unless given.
    """
    length = len(data)
    bits, state, crc = _header(can_id, extended, remote, length if dlc < 0 else dlc)
    bits += 8 * length
    for byte in data:
        key = state | byte
        bits += _STUFF_BITS[key]
        state = _NEXT_STATE[key]
        crc = (crc << 8 & 0x7FFF) ^ _CRC_TABLE[crc >> 7 ^ byte]
    key = state | crc >> 7
    return bits + _STUFF_BITS[key] + _STUFF_BITS_OF_7[_NEXT_STATE[key] | crc & 0x7F]


def device_frame_bits(can_id: int, data: bytes) -> int:
    """Bit times of a frame of the emulated devices: data frame, or error frame where `ERROR_FRAME` is in `can_id`."""
    return ERROR_FRAME_BITS if can_id & ERROR_FRAME else frame_bits(can_id, data)

"""Frame lengths against a bit-by-bit construction of the frame (ISO 11898-1)."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil.bus.bit_length import frame_bits


def constructed_length(can_id: int, data: bytes, extended: bool, remote: bool, dlc: int) -> int:
    """Write the frame down as a string of bits, stuff it, and count."""
    if extended:
        arbitration = f"{can_id >> 18:011b}" + "11" + f"{can_id & 0x3FFFF:018b}" + f"{remote:b}" + "00"
    else:
        arbitration = f"{can_id:011b}" + f"{remote:b}" + "00"
    bits = "0" + arbitration + f"{dlc:04b}" + "".join(f"{byte:08b}" for byte in data)
    # CRC-15 as polynomial division of the bit string, 15 zeros appended.
    remainder = int(bits, 2) << 15
    for shift in range(len(bits) - 1, -1, -1):
        if remainder >> (shift + 15) & 1:
            remainder ^= 0b1100010110011001 << shift
    bits += f"{remainder:015b}"
    stuffed = ""
    for bit in bits:
        stuffed += bit
        if len(stuffed) >= 5 and stuffed[-5:] == bit * 5:
            stuffed += "1" if bit == "0" else "0"
    return len(stuffed) + 1 + 2 + 7 + 3


@given(can_id=st.integers(0, 0x7FF), data=st.binary(max_size=8))
def test_standard_data_frames_have_the_length_of_their_bits(can_id: int, data: bytes) -> None:
    assert frame_bits(can_id, data) == constructed_length(can_id, data, False, False, len(data))


@given(can_id=st.integers(0, 0x1FFFFFFF), data=st.binary(max_size=8))
def test_extended_data_frames_have_the_length_of_their_bits(can_id: int, data: bytes) -> None:
    assert frame_bits(can_id, data, extended=True) == constructed_length(can_id, data, True, False, len(data))


@given(can_id=st.integers(0, 0x7FF), dlc=st.integers(0, 8))
def test_remote_frames_have_a_length_code_but_no_data(can_id: int, dlc: int) -> None:
    assert frame_bits(can_id, b"", remote=True, dlc=dlc) == constructed_length(can_id, b"", False, True, dlc)


@given(can_id=st.integers(0, 0x7FF), data=st.binary(max_size=8))
def test_lengths_lie_between_no_stuffing_and_the_worst_case(can_id: int, data: bytes) -> None:
    plain = 47 + 8 * len(data)
    assert plain <= frame_bits(can_id, data) <= plain + (34 + 8 * len(data) - 1) // 4


def test_the_cycle_of_the_default_network_loads_the_bus_by_about_half() -> None:
    drives, encoders = bytes.fromhex("37120a00a5c31b00"), bytes.fromhex("a5c30100")
    cycle = frame_bits(0x80, b"") + 4 * frame_bits(0x181, drives) + 2 * frame_bits(0x185, encoders)
    cycle += 4 * frame_bits(0x201, bytes.fromhex("0f00a501"))
    assert cycle * 1e-6 / 0.002 == pytest.approx(0.5, abs=0.07)

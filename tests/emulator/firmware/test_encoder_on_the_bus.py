"""A steering encoder, seen through its objects."""

from __future__ import annotations

import struct

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st


def u32(value: int) -> bytes:
    return struct.pack("<I", value)


def test_the_position_is_that_of_the_code_disc(wire) -> None:
    wire.vehicle.encoders[0].counts = 12345
    assert wire.read(5, 0x6004) == 12345
    assert wire.read(6, 0x6004) == 65536


def test_the_profile_says_single_turn_absolute_encoder(wire) -> None:
    assert wire.read(5, 0x1000) == 0x00010196
    assert wire.read(5, 0x6501) == 131072
    assert wire.read(5, 0x6502) == 1


def test_a_preset_makes_the_present_position_that_value_and_lasts_until_reset(wire) -> None:
    wire.vehicle.encoders[0].counts = 1000
    assert wire.write(5, 0x6003, 0, u32(65536)) == 0
    assert wire.read(5, 0x6004) == 65536
    wire.vehicle.encoders[0].counts = 1100
    assert wire.read(5, 0x6004) == 65636
    wire.nmt(0x81, 5)
    assert wire.read(5, 0x6004) == 1100


def test_the_code_sequence_turns_the_direction_round(wire) -> None:
    wire.vehicle.encoders[0].counts = 100
    assert wire.write(5, 0x6000, 0, struct.pack("<H", 0x0005)) == 0
    assert wire.read(5, 0x6004) == 131072 - 100


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(counts=st.integers(0, 131071), units=st.integers(1, 131072))
def test_scaling_divides_the_turn_into_the_units_asked_for(wire, counts: int, units: int) -> None:
    assert wire.write(5, 0x6001, 0, u32(units)) == 0
    wire.vehicle.encoders[0].counts = counts
    assert wire.read(5, 0x6004) == int(counts / 131072 * units)


def test_speed_is_the_change_of_position_from_sync_to_sync(wire) -> None:
    wire.write(5, 0x1800, 2, b"\x01")
    wire.nmt(0x01, 5)
    for k in range(3):
        wire.vehicle.encoders[0].counts = (131072 - 20 + 20 * k) % 131072
        wire.send(0x080)
        wire.wait(0.002)
    assert wire.read(5, 0x6030, 1, signed=True) == pytest.approx(10000)


def test_the_cyclic_timer_sends_the_position_at_its_period(wire) -> None:
    assert wire.write(5, 0x6200, 0, struct.pack("<H", 25)) == 0
    wire.nmt(0x01, 5)
    assert [can_id for can_id, _ in wire.wait(0.1)] == [0x185] * 4


def test_speed_is_there_without_sync_too(wire) -> None:
    wire.read(5, 0x6030, 1)
    wire.vehicle.encoders[0].counts += 300
    wire.wait(0.1)
    assert wire.read(5, 0x6030, 1, signed=True) == 3000


def test_without_scaling_the_position_is_that_of_the_code_disc_whatever_the_range(wire) -> None:
    assert wire.write(5, 0x6001, 0, u32(3600)) == 0
    assert wire.write(5, 0x6002, 0, u32(3600)) == 0
    wire.vehicle.encoders[0].counts = 131071
    assert wire.read(5, 0x6004) == 3599
    assert wire.write(5, 0x6000, 0, struct.pack("<H", 0)) == 0
    assert wire.read(5, 0x6004) == 131071
    assert wire.read(5, 0x6500) == 0


@pytest.mark.parametrize(
    ("index", "data", "refusal"),
    [
        (0x6000, struct.pack("<H", 0x0002), 0x06090030),
        (0x6000, struct.pack("<H", 0x8004), 0x06090030),
        (0x6001, u32(131073), 0x06090031),
        (0x6002, u32(131073), 0x06090031),
        (0x6003, u32(131072), 0x06090031),
        (0x6004, u32(0), 0x06010002),
        (0x6500, struct.pack("<H", 0), 0x06010002),
    ],
)
def test_what_the_encoder_cannot_do_is_refused(wire, index: int, data: bytes, refusal: int) -> None:
    before = wire.read(5, 0x6004)
    assert wire.write(5, index, 0, data) == refusal
    assert wire.read(5, 0x6004) == before


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    counts=st.integers(0, 131071),
    units=st.integers(1, 131072),
    preset=st.integers(0, 131071),
    reverse=st.booleans(),
)
def test_a_preset_holds_under_every_scaling_and_direction(
    wire, counts: int, units: int, preset: int, reverse: bool
) -> None:
    wire.vehicle.encoders[0].counts = counts
    assert wire.write(5, 0x6000, 0, struct.pack("<H", 4 | reverse)) == 0
    assert wire.write(5, 0x6001, 0, u32(units)) == 0
    assert wire.write(5, 0x6002, 0, u32(units)) == 0
    assert wire.write(5, 0x6003, 0, u32(preset % units)) == 0
    assert wire.read(5, 0x6004) == preset % units

"""Live PDO mapping by SDO, and its refusals (CiA 301, 7.5.2.35-38)."""

from __future__ import annotations

import struct

import pytest

INVALID = 0x80000000
TPDO1_COB = 0x40000181


def u32(value: int) -> bytes:
    return struct.pack("<I", value)


def entry(index: int, subindex: int, bits: int) -> bytes:
    return u32(index << 16 | subindex << 8 | bits)


def switch_off(wire, index: int = 0x1800, cob_id: int = TPDO1_COB) -> None:
    assert wire.write(1, index, 1, u32(cob_id | INVALID)) == 0


def test_a_remapped_tpdo_carries_the_new_objects(wire) -> None:
    wire.vehicle.drives[0].speed = 1.0
    switch_off(wire)
    assert wire.write(1, 0x1800, 2, b"\x01") == 0
    assert wire.write(1, 0x1A00, 0, b"\x00") == 0
    assert wire.write(1, 0x1A00, 1, entry(0x606C, 0, 32)) == 0
    assert wire.write(1, 0x1A00, 2, entry(0x1001, 0, 8)) == 0
    assert wire.write(1, 0x1A00, 0, b"\x02") == 0
    assert wire.write(1, 0x1800, 1, u32(TPDO1_COB)) == 0
    wire.nmt(0x01, 1)
    ((can_id, data),) = wire.send(0x080)
    assert (can_id, len(data)) == (0x181, 5)
    assert struct.unpack("<iB", data) == (wire.read(1, 0x606C, signed=True), 0)


def test_remapping_works_in_operational_too(wire) -> None:
    wire.make_synchronous(1)
    wire.nmt(0x01, 1)
    assert len(wire.send(0x080)[0][1]) == 8
    switch_off(wire)
    assert wire.send(0x080) == []
    wire.write(1, 0x1A00, 0, b"\x00")
    wire.write(1, 0x1A00, 1, entry(0x6041, 0, 16))
    wire.write(1, 0x1A00, 0, b"\x01")
    wire.write(1, 0x1800, 1, u32(TPDO1_COB))
    assert wire.send(0x080) == [(0x181, b"\x40\x02")]


def test_an_rpdo_may_skip_bytes_by_dummy_mapping(wire) -> None:
    switch_off(wire, 0x1400, 0x201)
    wire.write(1, 0x1400, 2, b"\xff")
    wire.write(1, 0x1600, 0, b"\x00")
    assert wire.write(1, 0x1600, 1, entry(0x0007, 0, 32)) == 0
    assert wire.write(1, 0x1600, 2, entry(0x6071, 0, 16)) == 0
    assert wire.write(1, 0x1600, 0, b"\x02") == 0
    assert wire.write(1, 0x1400, 1, u32(0x201)) == 0
    wire.nmt(0x01, 1)
    wire.send(0x201, struct.pack("<Ih", 0xFFFFFFFF, -123))
    assert wire.read(1, 0x6071, signed=True) == -123


def test_the_mapping_of_an_existing_pdo_cannot_be_changed(wire) -> None:
    assert wire.write(1, 0x1A00, 0, b"\x00") == 0x06010000
    assert wire.write(1, 0x1A00, 1, entry(0x6041, 0, 16)) == 0x06010000


def test_entries_cannot_be_written_before_the_count_is_zero(wire) -> None:
    switch_off(wire)
    assert wire.write(1, 0x1A00, 1, entry(0x6041, 0, 16)) == 0x06010000


REFUSED = {
    "an object that is not there": (entry(0x5555, 0, 16), 0x06020000),
    "an object that must not be mapped": (entry(0x1018, 1, 32), 0x06040041),
    "a length that is not the object's": (entry(0x6041, 0, 8), 0x06040042),
    "a sub-index that is not there": (entry(0x6041, 1, 16), 0x06090011),
    "a dummy in a TPDO": (entry(0x0005, 0, 8), 0x06040041),
    "a process output in a TPDO": (entry(0x6071, 0, 16), 0x06040041),
}


@pytest.mark.parametrize(("data", "code"), REFUSED.values(), ids=REFUSED)
def test_what_cannot_be_mapped_is_refused(wire, data: bytes, code: int) -> None:
    switch_off(wire)
    assert wire.write(1, 0x1A00, 0, b"\x00") == 0
    assert wire.write(1, 0x1A00, 1, data) == code


def test_a_read_only_object_cannot_be_received(wire) -> None:
    switch_off(wire, 0x1400, 0x201)
    wire.write(1, 0x1600, 0, b"\x00")
    assert wire.write(1, 0x1600, 1, entry(0x6041, 0, 16)) == 0x06040041


@pytest.mark.parametrize("count", [9, 64, 0xFE, 0xFF])
@pytest.mark.parametrize("base", [0x1400, 0x1800])
def test_more_than_eight_objects_do_not_fit(wire, base: int, count: int) -> None:
    switch_off(wire, base, 0x201 if base == 0x1400 else 0x181)
    wire.write(1, base + 0x200, 0, b"\x00")
    assert wire.write(1, base + 0x200, 0, bytes((count,))) == 0x06040042


def test_what_is_counted_must_be_mapped(wire) -> None:
    """Sub-index 0 may not be larger than the number of entries that are there."""
    switch_off(wire, 0x1801, 0x281)
    wire.write(1, 0x1A01, 0, b"\x00")
    for subindex in range(1, 9):
        assert wire.write(1, 0x1A01, subindex, entry(0, 0, 0)) == 0
    wire.write(1, 0x1A01, 1, entry(0x6041, 0, 16))
    assert wire.write(1, 0x1A01, 0, b"\x02") == 0x06020000
    assert wire.write(1, 0x1A01, 0, b"\x01") == 0


def test_a_pdo_that_was_refused_keeps_its_mapping(wire) -> None:
    switch_off(wire)
    wire.write(1, 0x1A00, 0, b"\x00")
    wire.write(1, 0x1A00, 1, entry(0x5555, 0, 16))
    assert wire.read(1, 0x1A00, 1) == 0x60410010


def test_an_inhibit_time_is_fixed_while_the_tpdo_exists(wire) -> None:
    assert wire.write(1, 0x1800, 3, b"\x0a\x00") == 0x08000022
    switch_off(wire)
    assert wire.write(1, 0x1800, 3, b"\x0a\x00") == 0


def test_two_rpdos_with_one_identifier_are_both_applied(wire) -> None:
    switch_off(wire, 0x1401, 0x301)
    wire.write(1, 0x1601, 0, b"\x00")
    wire.write(1, 0x1601, 1, entry(0x6040, 0, 16))
    wire.write(1, 0x1601, 2, entry(0x60FF, 0, 32))
    wire.write(1, 0x1601, 0, b"\x02")
    assert wire.write(1, 0x1401, 1, u32(0x201)) == 0
    wire.write(1, 0x1400, 2, b"\xff")
    wire.write(1, 0x1401, 2, b"\xff")
    wire.nmt(0x01, 1)
    wire.send(0x201, struct.pack("<Hi", 0x06, 77))
    assert (wire.read(1, 0x6040), wire.read(1, 0x6071), wire.read(1, 0x60FF)) == (0x06, 77, 77)


def test_more_than_eight_bytes_do_not_fit(wire) -> None:
    switch_off(wire)
    wire.write(1, 0x1A00, 0, b"\x00")
    for subindex in (1, 2, 3):
        assert wire.write(1, 0x1A00, subindex, entry(0x6064, 0, 32)) == 0
    assert wire.write(1, 0x1A00, 0, b"\x03") == 0x06040042
    assert wire.write(1, 0x1A00, 0, b"\x09") == 0x06040042
    assert wire.write(1, 0x1A00, 0, b"\x02") == 0


@pytest.mark.parametrize("identifier", [0x000, 0x07F, 0x101, 0x180, 0x581, 0x67F, 0x6E0, 0x701, 0x77F])
def test_restricted_identifiers_are_refused(wire, identifier: int) -> None:
    switch_off(wire)
    assert wire.write(1, 0x1800, 1, u32(INVALID | identifier)) == 0x06090030


def test_the_identifier_of_an_existing_pdo_cannot_change(wire) -> None:
    assert wire.write(1, 0x1800, 1, u32(0x40000190)) == 0x06090030
    switch_off(wire)
    assert wire.write(1, 0x1800, 1, u32(0x40000190)) == 0


@pytest.mark.parametrize("transmission_type", [241, 251, 252, 253])
def test_reserved_types_and_those_for_forbidden_remote_frames_are_refused(wire, transmission_type: int) -> None:
    assert wire.write(1, 0x1800, 2, bytes((transmission_type,))) == 0x06090030


@pytest.mark.parametrize("n", [1, 2, 5, 240])
def test_transmission_type_n_sends_with_every_nth_sync(wire, n: int) -> None:
    wire.write(1, 0x1800, 2, bytes((n,)))
    wire.nmt(0x01, 1)
    sent = [k for k in range(1, 2 * n + 1) if wire.send(0x080)]
    assert sent == [n, 2 * n]


def test_transmission_type_0_sends_at_the_sync_after_an_event(wire) -> None:
    wire.write(1, 0x1800, 2, b"\x00")
    wire.write(1, 0x1400, 2, b"\xff")
    wire.nmt(0x01, 1)
    assert len(wire.send(0x080)) == 1
    assert wire.send(0x080) == []
    wire.send(0x201, struct.pack("<Hh", 0x06, 0))
    assert len(wire.send(0x080)) == 1


def test_an_event_driven_tpdo_goes_out_when_the_state_changes(wire) -> None:
    wire.write(1, 0x1400, 2, b"\xff")
    wire.nmt(0x01, 1)
    # The TPDO that says "operational" begins the inhibit time, 10 ms as delivered.
    wire.wait(0.011)
    frames = wire.send(0x201, struct.pack("<Hh", 0x06, 0))
    assert [data[:2] for can_id, data in frames if can_id == 0x181] == [b"\x21\x02"]


def test_event_timer_and_inhibit_time_hold(wire) -> None:
    switch_off(wire)
    assert wire.write(1, 0x1800, 3, struct.pack("<H", 300)) == 0  # 30 ms
    assert wire.write(1, 0x1800, 5, struct.pack("<H", 100)) == 0
    wire.write(1, 0x1400, 2, b"\xff")
    wire.write(1, 0x1800, 1, u32(TPDO1_COB))
    wire.nmt(0x01, 1)
    assert len(wire.wait(1.0)) == 10
    wire.wait(0.05)
    first = wire.send(0x201, struct.pack("<Hh", 0x06, 0))
    second = wire.send(0x201, struct.pack("<Hh", 0x07, 0))
    assert [len(first), len(second)] == [1, 0]
    later = wire.wait(0.03)
    assert [data[:2] for _, data in later] == [b"\x33\x02"]


def test_an_rpdo_of_the_wrong_length_is_reported_and_a_short_one_is_not_applied(wire) -> None:
    wire.nmt(0x01, 1)
    assert (0x081, struct.pack("<HBH3x", 0x8210, 0x11, 1)) in wire.send(0x201, b"\x06")
    assert wire.read(1, 0x6041) & 0x4F == 0x40
    frames = wire.send(0x201, struct.pack("<Hhi", 0x06, 0, 0))
    assert any(can_id == 0x081 and data[:2] == b"\x20\x82" for can_id, data in frames)
    assert wire.read(1, 0x6041) & 0x6F == 0x21


def test_pdos_rest_outside_operational(wire) -> None:
    wire.make_synchronous(1)
    assert wire.send(0x080) == []
    wire.nmt(0x01, 1)
    assert len(wire.send(0x080)) == 1
    wire.nmt(0x02, 1)
    assert wire.send(0x080) == []


def test_a_reset_brings_the_mapping_of_the_eds_back(wire) -> None:
    switch_off(wire)
    wire.write(1, 0x1A00, 0, b"\x00")
    wire.nmt(0x82, 1)
    assert wire.read(1, 0x1A00, 0) == 3
    assert wire.read(1, 0x1800, 1) == TPDO1_COB


def test_simultaneous_tpdos_come_in_the_order_of_their_identifiers(wire) -> None:
    for node_id in range(1, 7):
        wire.write(node_id, 0x1800, 2, b"\x01")
    wire.write(1, 0x1801, 2, b"\x01")
    wire.write(1, 0x1801, 1, u32(0x40000281))
    wire.nmt(0x01)
    assert [can_id for can_id, _ in wire.send(0x080)] == [0x181, 0x182, 0x183, 0x184, 0x185, 0x186, 0x281]

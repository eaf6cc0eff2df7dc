"""SYNC: identifier, producer and counter (CiA 301, 7.2.5), and the start value of TPDOs."""

from __future__ import annotations

import struct

import pytest

PRODUCES = 1 << 30


def set_period(wire, node_id: int, microseconds: int) -> int:
    return wire.write(node_id, 0x1006, 0, struct.pack("<I", microseconds))


def produce(wire, node_id: int, cob_id: int = 0x080) -> int:
    return wire.write(node_id, 0x1005, 0, struct.pack("<I", PRODUCES | cob_id))


def test_a_node_listens_to_the_sync_that_1005h_names(wire) -> None:
    wire.make_synchronous(1)
    wire.write(1, 0x1005, 0, struct.pack("<I", 0x0A0))
    wire.nmt(0x01, 1)
    assert wire.send(0x080) == []
    assert [can_id for can_id, _ in wire.send(0x0A0)] == [0x181]


@pytest.mark.parametrize("cob_id", [0x000, 0x07F, 0x101, 0x180, 0x581, 0x601, 0x6E0, 0x701, 0x800, 1 << 29 | 0x80])
def test_restricted_identifiers_are_refused(wire, cob_id: int) -> None:
    assert wire.write(1, 0x1005, 0, struct.pack("<I", cob_id)) == 0x06090030


def test_a_producer_sends_every_period(wire) -> None:
    set_period(wire, 3, 10_000)
    produce(wire, 3)
    frames = wire.wait(0.1)
    assert frames == [(0x080, b"")] * 10
    wire.write(3, 0x1005, 0, struct.pack("<I", 0x080))
    assert wire.wait(0.1) == []


def test_the_other_nodes_and_the_producer_act_on_its_sync(wire) -> None:
    for node_id in (1, 3):
        wire.make_synchronous(node_id)
    set_period(wire, 3, 10_000)
    produce(wire, 3)
    wire.nmt(0x01)
    assert [can_id for can_id, _ in wire.wait(0.0101)] == [0x080, 0x181, 0x183]


def test_a_stopped_node_produces_no_sync(wire) -> None:
    set_period(wire, 3, 10_000)
    produce(wire, 3)
    wire.nmt(0x02, 3)
    assert wire.wait(0.1) == []
    wire.nmt(0x80, 3)
    assert len(wire.wait(0.1)) == 10


def test_a_producer_keeps_its_beat_when_it_becomes_operational(wire) -> None:
    set_period(wire, 3, 10_000)
    produce(wire, 3)
    wire.wait(0.015)
    wire.nmt(0x01, 3)
    assert [can_id for can_id, _ in wire.wait(0.0051)][:1] == [0x080]


def test_a_node_that_was_reset_produces_no_longer(wire) -> None:
    set_period(wire, 3, 10_000)
    produce(wire, 3)
    wire.nmt(0x82, 3)
    assert wire.wait(0.1) == []


def test_the_identifier_of_a_producer_is_fixed(wire) -> None:
    set_period(wire, 3, 10_000)
    produce(wire, 3)
    assert produce(wire, 3, 0x0A0) == 0x06090030
    assert wire.write(3, 0x1005, 0, struct.pack("<I", 0x0A0)) == 0


@pytest.mark.parametrize(("value", "refusal"), [(0, 0), (1, 0x06090030), (2, 0), (240, 0), (241, 0x06090030)])
def test_the_counter_overflows_at_2_to_240_or_is_off(wire, value: int, refusal: int) -> None:
    assert wire.write(3, 0x1019, 0, bytes((value,))) == refusal


def test_the_counter_cannot_change_while_there_is_a_period(wire) -> None:
    set_period(wire, 3, 1000)
    assert wire.write(3, 0x1019, 0, b"\x05") == 0x08000022
    set_period(wire, 3, 0)
    assert wire.write(3, 0x1019, 0, b"\x05") == 0


def test_a_producer_counts_from_one_and_starts_again(wire) -> None:
    wire.write(3, 0x1019, 0, b"\x03")
    set_period(wire, 3, 10_000)
    produce(wire, 3)
    assert [data for can_id, data in wire.wait(0.07) if can_id == 0x080] == [bytes((k,)) for k in (1, 2, 3, 1, 2, 3, 1)]


@pytest.mark.parametrize(("overflow", "data"), [(0, b"\x01"), (0, bytes(8)), (10, b""), (10, b"\x01\x02")])
def test_a_sync_of_the_wrong_length_is_reported_and_not_used(wire, overflow: int, data: bytes) -> None:
    wire.write(1, 0x1019, 0, bytes((overflow,)))
    wire.make_synchronous(1)
    wire.nmt(0x01, 1)
    frames = wire.send(0x080, data)
    assert [struct.unpack_from("<H", data)[0] for can_id, data in frames if can_id == 0x081] == [0x8240]
    assert not [can_id for can_id, _ in frames if can_id == 0x181]
    frames = wire.send(0x080, b"\x01" if overflow else b"")
    assert [struct.unpack_from("<H", data)[0] for can_id, data in frames if can_id == 0x081] == [0]
    assert [can_id for can_id, _ in frames if can_id == 0x181]


@pytest.mark.parametrize(("start", "every"), [(1, 1), (3, 2), (5, 4)])
def test_a_tpdo_begins_with_its_sync_start_value(wire, start: int, every: int) -> None:
    wire.write(1, 0x1019, 0, b"\x0a")
    wire.write(1, 0x1800, 1, struct.pack("<I", 1 << 31 | 0x181))
    wire.write(1, 0x1800, 2, bytes((every,)))
    assert wire.write(1, 0x1800, 6, bytes((start,))) == 0
    wire.write(1, 0x1800, 1, struct.pack("<I", 0x181))
    wire.nmt(0x01, 1)
    numbers = [k % 10 + 1 for k in range(20)]
    sent = [k for k, number in enumerate(numbers) if 0x181 in dict(wire.send(0x080, bytes((number,))))]
    assert sent == list(range(start - 1, 20, every))


def test_the_sync_start_value_of_an_existing_tpdo_is_fixed(wire) -> None:
    assert wire.write(1, 0x1800, 6, b"\x02") == 0x08000022

"""Node guarding and life guarding (CiA 301, 7.2.8.3.1)."""

from __future__ import annotations

import struct


def guard(wire, node_id: int, milliseconds: int, factor: int) -> None:
    assert wire.write(node_id, 0x100C, 0, struct.pack("<H", milliseconds)) == 0
    assert wire.write(node_id, 0x100D, 0, bytes((factor,))) == 0


def codes(frames, node_id: int) -> list[int]:
    return [struct.unpack_from("<H", data)[0] for can_id, data in frames if can_id == 0x080 + node_id]


def test_every_remote_frame_is_answered_with_the_state_and_a_toggle_bit(wire) -> None:
    guard(wire, 5, 100, 3)
    for state, command in ((0x7F, 0x80), (0x05, 0x01), (0x04, 0x02)):
        wire.nmt(0x82, 5)
        guard(wire, 5, 100, 3)
        wire.nmt(command, 5)
        answers = [wire.remote(0x705) for _ in range(4)]
        assert answers == [[(0x705, bytes((state | toggle,)))] for toggle in (0, 0x80, 0, 0x80)]


def test_the_toggle_bit_starts_anew_after_a_reset(wire) -> None:
    assert wire.remote(0x705) == [(0x705, b"\x7f")]
    wire.nmt(0x82, 5)
    assert wire.remote(0x705) == [(0x705, b"\x7f")]


def test_life_guarding_notices_a_master_that_stops_asking(wire) -> None:
    guard(wire, 1, 100, 3)
    wire.nmt(0x01, 1)
    assert codes(wire.wait(10.0), 1) == [], "guarding starts with the first remote frame"
    for _ in range(5):
        wire.remote(0x701)
        assert codes(wire.wait(0.29), 1) == []
    assert codes(wire.wait(0.011), 1) == [0x8130]
    # 1029h:1 is 0: operational becomes pre-operational.
    assert wire.remote(0x701)[-1][1][0] & 0x7F == 0x7F


def test_life_guarding_is_over_when_the_master_asks_again(wire) -> None:
    guard(wire, 5, 100, 2)
    wire.remote(0x705)
    assert codes(wire.wait(0.3), 5) == [0x8130]
    assert wire.read(5, 0x1001) == 0x11
    assert codes(wire.remote(0x705), 5) == [0x0000]
    assert wire.read(5, 0x1001) == 0


def test_a_node_without_a_life_time_answers_and_watches_nobody(wire) -> None:
    guard(wire, 1, 100, 0)
    assert len(wire.remote(0x701)) == 1
    assert codes(wire.wait(60.0), 1) == []


def test_a_node_with_a_heartbeat_is_not_guarded(wire) -> None:
    guard(wire, 1, 100, 2)
    wire.remote(0x701)
    wire.write(1, 0x1017, 0, struct.pack("<H", 50))
    assert wire.remote(0x701) == []
    assert {data for can_id, data in wire.wait(1.0) if can_id == 0x701} == {b"\x7f"}
    wire.write(1, 0x1017, 0, b"\x00\x00")
    assert len(wire.remote(0x701)) == 1

"""NMT states, boot-up, resets, and heartbeat production."""

from __future__ import annotations

import struct

import pytest


def test_every_node_boots_up_once_at_power_on(wire) -> None:
    assert sorted(wire.frames()) == [(0x700 + node_id, b"\x00") for node_id in range(1, 7)]


@pytest.mark.parametrize("command", [0x81, 0x82])
def test_a_reset_is_answered_by_boot_up(wire, command: int) -> None:
    assert wire.nmt(command, 3) == [(0x703, b"\x00")]
    assert len(wire.nmt(command, 0)) == 6


def test_a_node_reset_restores_everything_and_a_communication_reset_the_communication_objects(wire) -> None:
    def write() -> None:
        wire.write(1, 0x1017, 0, struct.pack("<H", 100))
        wire.write(1, 0x6087, 0, struct.pack("<I", 5))

    write()
    wire.nmt(0x82, 1)
    assert (wire.read(1, 0x1017), wire.read(1, 0x6087)) == (0, 5)
    write()
    wire.nmt(0x81, 1)
    assert (wire.read(1, 0x1017), wire.read(1, 0x6087)) == (0, 10000)
    assert wire.wait(1.0) == []


STATES = {0x01: 0x05, 0x02: 0x04, 0x80: 0x7F}


@pytest.mark.parametrize(("command", "state"), STATES.items())
def test_the_heartbeat_tells_the_state(wire, command: int, state: int) -> None:
    wire.write(4, 0x1017, 0, struct.pack("<H", 20))
    wire.nmt(command, 4)
    assert [frame for frame in wire.wait(0.1) if frame[0] == 0x704] == [(0x704, bytes((state,)))] * 5


def test_heartbeats_come_at_their_instants(wire) -> None:
    wire.write(1, 0x1017, 0, struct.pack("<H", 7))
    assert wire.devices.next_event() == pytest.approx(0.007)
    assert wire.wait(0.006) == []
    assert wire.wait(0.001) == [(0x701, b"\x7f")]
    wire.write(1, 0x1017, 0, b"\x00\x00")
    assert wire.wait(1.0) == []


@pytest.mark.parametrize("data", [b"", b"\x01", b"\x01\x00\x00", b"\x55\x00", b"\x01\x09"])
def test_what_is_no_command_to_a_node_changes_nothing(wire, data: bytes) -> None:
    wire.write(1, 0x1017, 0, struct.pack("<H", 10))
    assert wire.send(0x000, data) == []
    assert wire.wait(0.01) == [(0x701, b"\x7f")]


def test_power_stays_off_at_boot(wire) -> None:
    assert not any(drive.enabled for drive in wire.vehicle.drives)


def test_frames_to_nobody_are_ignored(wire) -> None:
    for can_id in (0x100, 0x17F, 0x5FF, 0x67F, 0x77F, 0x7FF):
        assert wire.send(can_id, bytes(8)) == []

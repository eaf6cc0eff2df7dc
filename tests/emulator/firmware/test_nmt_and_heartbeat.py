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


def watch(wire, node_id: int, watched: int, milliseconds: int) -> None:
    assert wire.write(node_id, 0x1016, 1, struct.pack("<I", watched << 16 | milliseconds)) == 0


def emergencies(frames: list[tuple[int, bytes]], node_id: int) -> list[int]:
    return [struct.unpack_from("<H", data)[0] for can_id, data in frames if can_id == 0x080 + node_id]


def test_a_heartbeat_faster_than_the_consumer_time_is_enough(wire) -> None:
    watch(wire, 4, 0x47, 1000)
    wire.nmt(0x01, 4)
    for _ in range(30):
        assert emergencies(wire.send(0x747, b"\x7f") + wire.wait(0.95), 4) == []


def test_a_heartbeat_slower_than_the_consumer_time_is_lost_and_found(wire) -> None:
    watch(wire, 6, 0x47, 1000)
    assert emergencies(wire.wait(10.0), 6) == [], "monitoring starts with the first heartbeat"
    wire.send(0x747, b"\x7f")
    for _ in range(5):
        assert emergencies(wire.wait(0.999), 6) == []
        assert emergencies(wire.wait(0.1), 6) == [0x8130]
        assert wire.read(6, 0x1001) == 0x11
        assert emergencies(wire.send(0x747, b"\x7f"), 6) == [0x0000]
        assert wire.read(6, 0x1001) == 0


def test_a_drive_keeps_the_error_until_its_fault_is_reset(wire) -> None:
    """With 6007h = 1 a lost master is a fault of the drive too, and that does not end with the next heartbeat."""
    watch(wire, 4, 0x47, 1000)
    wire.nmt(0x01, 4)
    wire.send(0x747, b"\x05")
    assert emergencies(wire.wait(1.1), 4) == [0x8130]
    assert emergencies(wire.send(0x747, b"\x05"), 4) == []
    assert wire.read(4, 0x1001) & 0x01
    wire.nmt(0x01, 4)
    wire.write(4, 0x6040, 0, b"\x00\x00")
    frames = wire.send(0x604, b"\x2b\x40\x60\x00\x80\x00\x00\x00")
    assert emergencies(frames, 4) == [0x0000]
    assert wire.read(4, 0x1001) == 0


def test_a_watched_node_that_resets_is_watched_on(wire) -> None:
    watch(wire, 4, 0x47, 1000)
    wire.nmt(0x01, 4)
    wire.send(0x747, b"\x05")
    wire.send(0x747, b"\x00")
    assert emergencies(wire.wait(0.9), 4) == []
    assert emergencies(wire.wait(0.2), 4) == [0x8130]


def test_nodes_hear_the_heartbeats_of_each_other(wire) -> None:
    watch(wire, 4, 5, 100)
    wire.write(5, 0x1017, 0, struct.pack("<H", 50))
    assert emergencies(wire.wait(2.0), 4) == []
    wire.write(5, 0x1017, 0, b"\x00\x00")
    assert emergencies(wire.wait(0.2), 4) == [0x8130]


def test_a_drive_can_follow_what_another_node_sends(wire) -> None:
    """The TPDO of an encoder as RPDO of a drive: only the frames connect them."""
    wire.write(5, 0x1800, 2, b"\x01")
    wire.write(1, 0x1402, 1, struct.pack("<I", 0x80000185))
    wire.write(1, 0x1602, 0, b"\x00")
    wire.write(1, 0x1602, 1, struct.pack("<I", 0x60710010))
    wire.write(1, 0x1602, 2, struct.pack("<I", 0x00060010))
    wire.write(1, 0x1602, 0, b"\x02")
    wire.write(1, 0x1402, 1, struct.pack("<I", 0x185))
    wire.nmt(0x01)
    wire.send(0x080)
    wire.wait(0.001)
    assert wire.read(1, 0x6071) == wire.read(5, 0x6004) & 0xFFFF


def test_a_node_without_supply_misses_nobody_and_boots_afterwards(wire) -> None:
    watch(wire, 1, 0x7F, 100)
    wire.nmt(0x01, 1)
    wire.send(0x77F, b"\x05")
    wire.devices.power_off(1)
    assert wire.wait(1.0) == []
    wire.frames()
    wire.devices.power_on(1)
    assert wire.frames() == [(0x701, b"\x00")]
    assert wire.read(1, 0x1001) == 0


STATES_AFTER_LOSS = {0: 0x7F, 1: 0x05, 2: 0x04}


@pytest.mark.parametrize(("behaviour", "state"), STATES_AFTER_LOSS.items())
def test_1029h_says_which_state_a_lost_master_leads_to(wire, behaviour: int, state: int) -> None:
    watch(wire, 5, 0x7F, 100)
    wire.write(5, 0x1029, 1, bytes((behaviour,)))
    wire.nmt(0x01, 5)
    wire.send(0x77F, b"\x05")
    wire.wait(0.2)
    assert wire.remote(0x705)[0][1][0] & 0x7F == state

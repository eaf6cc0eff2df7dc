"""Layer setting services (CiA 305): by bare frames, and by python canopen's LSS master.

The frames are those of CiA DSP 305, version 2.2 (github.com/user-attachments/files/30225828/DS305.pdf), and of the
table of command specifiers at docs.rs/zencan-common, `LssCommandSpecifier`.
"""

from __future__ import annotations

import struct

import canopen
import pytest

from emulator.firmware.storage import FolderMemory

VENDOR, REVISION = 0x7FFF0001, 0x00010000
DRIVE, ENCODER = 0x402, 0x406
SERIAL = 0x20260000
MASTER, SLAVE = 0x7E5, 0x7E4
NOBODY = 0xFF


class Lss:
    """A master of bare frames."""

    def __init__(self, wire) -> None:
        self.wire = wire

    def ask(self, command: int, *data: int) -> list[bytes]:
        """What the slaves answer."""
        frames = self.wire.send(MASTER, bytes((command, *data)).ljust(8, b"\x00"))
        return [data for can_id, data in frames if can_id == SLAVE]

    def number(self, command: int, number: int) -> list[bytes]:
        return self.ask(command, *struct.pack("<I", number))

    def switch(self, mode: int) -> list[tuple[int, bytes]]:
        return self.wire.send(MASTER, bytes((0x04, mode)).ljust(8, b"\x00"))

    def select(self, product: int = DRIVE, serial: int = SERIAL + 1, vendor: int = VENDOR) -> list[bytes]:
        for command, number in ((0x40, vendor), (0x41, product), (0x42, REVISION)):
            assert self.number(command, number) == []
        return self.number(0x43, serial)

    def identify(self, product: int, revisions: tuple[int, int], serials: tuple[int, int]) -> list[bytes]:
        numbers = (VENDOR, product, *revisions, *serials)
        return [answer for command, number in enumerate(numbers, 0x46) for answer in self.number(command, number)]

    def give(self, node_id: int) -> None:
        """Node 1 gets another node-ID with the next reset."""
        assert self.select() == [b"\x44" + bytes(7)]
        assert self.ask(0x11, node_id) == [b"\x11" + bytes(7)]


@pytest.fixture
def lss(wire) -> Lss:
    return Lss(wire)


def boot_ups(frames: list[tuple[int, bytes]]) -> list[int]:
    return [can_id - 0x700 for can_id, data in frames if can_id > 0x700 and data == b"\x00"]


def test_the_one_with_this_identity_goes_to_configuration_and_no_other(lss: Lss) -> None:
    assert lss.select(serial=SERIAL + 3) == [b"\x44" + bytes(7)]
    assert lss.ask(0x5E) == [bytes((0x5E, 3)) + bytes(6)]
    numbers = [lss.ask(command) for command in (0x5A, 0x5B, 0x5C, 0x5D)]
    assert [struct.unpack_from("<I", answer, 1)[0] for (answer,) in numbers] == [VENDOR, DRIVE, REVISION, SERIAL + 3]


@pytest.mark.parametrize("wrong", [{"vendor": 1}, {"product": ENCODER}, {"serial": SERIAL + 9}])
def test_an_identity_that_nobody_has_selects_nobody(lss: Lss, wrong: dict[str, int]) -> None:
    assert lss.select(**wrong) == []
    assert lss.ask(0x5E) == []


def test_steps_of_the_selection_in_another_order_select_nobody(lss: Lss) -> None:
    for command, number in ((0x41, DRIVE), (0x40, VENDOR), (0x42, REVISION)):
        lss.number(command, number)
    assert lss.number(0x43, SERIAL + 1) == []


def test_the_global_switch_reaches_all(lss: Lss) -> None:
    lss.switch(1)
    assert sorted(answer[1] for answer in lss.ask(0x5E)) == [1, 2, 3, 4, 5, 6]
    lss.switch(0)
    assert lss.ask(0x5E) == []


def test_a_device_in_waiting_lets_nobody_configure_it(lss: Lss) -> None:
    assert [lss.ask(command, 9) for command in (0x11, 0x13, 0x17, 0x5A)] == [[], [], [], []]


def test_a_node_id_comes_with_the_next_reset(lss: Lss, wire) -> None:
    lss.give(77)
    lss.switch(0)
    assert wire.read(1, 0x1018, 4) == SERIAL + 1
    assert boot_ups(wire.nmt(0x82, 1)) == [77]
    assert wire.send(0x601, bytes.fromhex("4000100000000000")) == []
    assert wire.read(77, 0x1018, 4) == SERIAL + 1, "the identity is the device's"
    assert wire.read(77, 0x1800, 1) == 0x40000180 + 77
    assert wire.read(77, 0x1014) == 0x80 + 77


def test_under_its_new_node_id_a_drive_runs(lss: Lss, wire) -> None:
    lss.give(99)
    lss.switch(0)
    wire.nmt(0x81)
    wire.enable(99)
    wire.command(99, 0x0F, 100)
    assert wire.vehicle.drives[0].torque == pytest.approx(0.127)
    wire.vehicle.drives[0].speed = 1.0
    assert wire.read(99, 0x606C) > 0


def test_a_drive_that_runs_is_off_when_it_becomes_another(lss: Lss, wire) -> None:
    wire.enable(1)
    wire.command(1, 0x0F, 100)
    wire.write(1, 0x1017, 0, b"\x0a\x00")
    lss.give(20)
    lss.switch(0)
    wire.nmt(0x82, 1)
    assert not wire.vehicle.drives[0].enabled
    assert all(can_id != 0x701 for can_id, _ in wire.wait(0.1)), "no heartbeat of what it was"
    wire.nmt(0x01, 1)
    assert wire.read(20, 0x6041) & 0x27F == 0x40


@pytest.mark.parametrize("node_id", [0, 128, 254])
def test_a_node_id_out_of_range_is_refused(lss: Lss, node_id: int) -> None:
    lss.select()
    assert lss.ask(0x11, node_id) == [b"\x11\x01" + bytes(6)]


@pytest.mark.parametrize(("table", "index", "error"), [(0, 0, 0), (0, 4, 0), (0, 1, 1), (0, 8, 1), (1, 0, 1)])
def test_bit_rates_are_those_of_the_eds(lss: Lss, table: int, index: int, error: int) -> None:
    lss.select()
    assert lss.ask(0x13, table, index) == [bytes((0x13, error)) + bytes(6)]


def test_what_is_not_stored_is_gone_with_the_supply(lss: Lss, wire) -> None:
    lss.give(77)
    wire.nmt(0x81)
    wire.devices.power_off(1)
    wire.devices.power_on(1)
    assert boot_ups(wire.frames()) == [1]


def test_what_is_stored_outlives_supply_and_process(tmp_path, wire_type) -> None:
    memory = FolderMemory(tmp_path)
    first = wire_type(memory)
    lss = Lss(first)
    lss.give(77)
    assert lss.ask(0x17) == [b"\x17" + bytes(7)]
    first.devices.power_off(1)
    first.frames()
    first.devices.power_on(1)
    assert boot_ups(first.frames()) == [77]
    second = wire_type(memory)
    assert second.read(77, 0x1018, 4) == SERIAL + 1


def test_parameters_stay_those_of_the_device(tmp_path, wire_type) -> None:
    wire = wire_type(FolderMemory(tmp_path))
    lss = Lss(wire)
    wire.write(1, 0x6087, 0, struct.pack("<I", 4321))
    wire.write(1, 0x1010, 1, b"save")
    lss.give(77)
    wire.nmt(0x82, 1)
    assert wire.read(77, 0x6087) == 4321


def test_a_memory_that_cannot_be_written_is_said(tmp_path, wire_type) -> None:
    (tmp_path / "file").write_text("")
    lss = Lss(wire_type(FolderMemory(tmp_path / "file" / "folder")))
    lss.select()
    assert lss.ask(0x17) == [b"\x17\x02" + bytes(6)]


def test_a_device_without_a_node_id_is_silent_until_it_gets_one(lss: Lss, wire) -> None:
    lss.give(NOBODY)
    lss.switch(0)
    assert boot_ups(wire.nmt(0x81, 1)) == []
    assert wire.nmt(0x81, 1) == []
    assert wire.send(0x601, bytes.fromhex("4000100000000000")) == []
    assert lss.ask(0x4C) == [b"\x50" + bytes(7)]
    lss.give(5 + 64)
    assert boot_ups(lss.switch(0)) == [69]
    assert wire.read(69, 0x1000) == 0x00020192
    assert lss.ask(0x4C) == []


def test_slaves_are_identified_by_ranges(lss: Lss) -> None:
    assert len(lss.identify(DRIVE, (0, REVISION), (SERIAL + 2, SERIAL + 3))) == 2
    assert len(lss.identify(ENCODER, (REVISION, REVISION), (0, 0xFFFFFFFF))) == 2
    assert lss.identify(DRIVE, (REVISION + 1, REVISION + 2), (0, 0xFFFFFFFF)) == []


def test_without_supply_there_is_no_lss(lss: Lss, wire) -> None:
    wire.devices.power_off(1)
    assert lss.select() == []


@pytest.mark.parametrize(
    "data", [b"", b"\x5e", b"\x04\x01", b"\x99" + bytes(7), b"\x51" + b"\xff" * 7, b"\x51" + bytes(4) + b"\x1f\x09\x00"]
)
def test_frames_that_are_no_service_are_ignored(lss: Lss, wire, data: bytes) -> None:
    lss.give(NOBODY)
    lss.switch(0)
    wire.nmt(0x81, 1)
    assert wire.send(MASTER, data) == []


class Network(canopen.Network):
    """canopen's network on the wire of the devices."""

    def __init__(self, wire) -> None:
        super().__init__()
        self.wire = wire
        self.lss.RESPONSE_TIMEOUT = 0.001

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        for answer_id, answer in self.wire.send(can_id, bytes(data)):
            self.notify(answer_id, bytearray(answer), 0.0)


@pytest.fixture
def master(wire, monkeypatch: pytest.MonkeyPatch):
    # canopen pauses between frames for slow devices.
    monkeypatch.setattr("canopen.lss.time.sleep", lambda seconds: None)
    return Network(wire).lss


def test_an_independent_master_finds_who_has_no_node_id_and_gives_one(lss: Lss, wire, master) -> None:
    lss.give(NOBODY)
    lss.switch(0)
    wire.nmt(0x81)
    found, identity = master.fast_scan()
    assert found
    assert identity == [VENDOR, DRIVE, REVISION, SERIAL + 1]
    master.configure_node_id(42)
    master.configure_bit_timing(3)
    master.store_configuration()
    master.send_switch_state_global(master.WAITING_STATE)
    assert wire.read(42, 0x1018, 4) == SERIAL + 1
    assert master.fast_scan() == (False, None)


def test_an_independent_master_finds_all_of_a_vehicle_that_has_no_node_ids(lss: Lss, wire, master) -> None:
    """Fastscan finds one after the other; the vehicle then is the one that it was."""
    lss.switch(1)
    assert len(lss.ask(0x11, NOBODY)) == 6
    lss.switch(0)
    wire.nmt(0x82)
    given = {}
    for node_id in range(10, 16):
        found, identity = master.fast_scan()
        assert found
        given[node_id] = identity[3]
        master.configure_node_id(node_id)
        master.send_switch_state_global(master.WAITING_STATE)
    assert master.fast_scan() == (False, None)
    assert {node_id: wire.read(node_id, 0x1018, 4) for node_id in given} == given
    assert sorted(given.values()) == [SERIAL + k for k in range(1, 7)]


def test_an_independent_master_selects_and_asks(wire, master) -> None:
    assert master.send_switch_state_selective(VENDOR, ENCODER, REVISION, SERIAL + 5)
    assert master.inquire_node_id() == 5
    assert [master.inquire_lss_address(command) for command in range(0x5A, 0x5E)] == [
        VENDOR,
        ENCODER,
        REVISION,
        SERIAL + 5,
    ]

"""CiA 301 object by object, where devices are known to differ; each test names a source that anybody can reach."""

from __future__ import annotations

import struct

import pytest

from emulator.power_stage import Trip

DRIVE, ENCODER = 1, 5
MIDNIGHT = struct.pack("<IH", 0, 0)
NOON = struct.pack("<IH", 12 * 3_600_000, 15_000)


def u32(value: int) -> bytes:
    return struct.pack("<I", value)


def u16(value: int) -> bytes:
    return struct.pack("<H", value)


def configure(wire, node_id: int, *, kind: int, inhibit: int = 0, event: int = 0) -> None:
    """The first TPDO by the procedure of CiA 301; inhibit time in 0.1 ms, event timer in ms."""
    cob_id = wire.read(node_id, 0x1800, 1)
    assert wire.write(node_id, 0x1800, 1, u32(cob_id | 1 << 31)) == 0
    assert wire.write(node_id, 0x1800, 2, bytes((kind,))) == 0
    assert wire.write(node_id, 0x1800, 3, u16(inhibit)) == 0
    assert wire.write(node_id, 0x1800, 5, u16(event)) == 0
    assert wire.write(node_id, 0x1800, 1, u32(cob_id)) == 0


class TestChangeOfState:
    """180xh:2 = 254, 255: "As long as the element to send the PDO is stopped (its position has not changed), it will
    not have to be sent. When programming a 10 ms event timer, even if the element does not change its position it will
    send"; 180xh:3 is "the minimum time interval between PDOs". Fagor, MCP/MCPi CANopen manual, page 16
    (manuzoid.com/manuals/GrNGA)."""

    @pytest.mark.parametrize("kind", [254, 255])
    def test_a_shaft_that_turns_sends_and_one_that_stands_does_not(self, wire, kind: int) -> None:
        configure(wire, DRIVE, kind=kind)
        wire.nmt(0x01, DRIVE)
        assert wire.wait(0.5) == []
        shaft = wire.vehicle.drives[0]
        shaft.speed, shaft.friction = 1.0, 1e-9
        frames = wire.wait(0.1)
        assert len(frames) == 100, "every millisecond, without an inhibit time"
        positions = [struct.unpack("<Hhi", data)[2] for _, data in frames]
        assert positions == sorted(set(positions))

    def test_the_inhibit_time_lies_between_two(self, wire) -> None:
        configure(wire, DRIVE, kind=255, inhibit=250)
        wire.nmt(0x01, DRIVE)
        shaft = wire.vehicle.drives[0]
        shaft.speed, shaft.friction = 1.0, 1e-9
        assert len(wire.wait(1.0)) == 40

    def test_what_changed_within_the_inhibit_time_goes_out_at_its_end(self, wire) -> None:
        configure(wire, ENCODER, kind=254, inhibit=500)
        wire.nmt(0x01, ENCODER)
        wire.wait(0.01)
        wire.vehicle.encoders[0].counts = 4711
        assert wire.wait(0.035) == []
        assert wire.wait(0.01) == [(0x185, u32(4711))]
        assert wire.wait(1.0) == []

    def test_a_value_that_comes_and_goes_within_it_was_never_there(self, wire) -> None:
        configure(wire, ENCODER, kind=255, inhibit=500)
        wire.nmt(0x01, ENCODER)
        before = wire.vehicle.encoders[0].counts
        wire.vehicle.encoders[0].counts = 4711
        wire.wait(0.01)
        wire.vehicle.encoders[0].counts = before
        assert wire.wait(0.2) == []

    def test_the_statusword_is_sent_at_once(self, wire) -> None:
        configure(wire, DRIVE, kind=255)
        wire.nmt(0x01, DRIVE)
        frames = wire.send(0x201, struct.pack("<Hh", 0x06, 0))
        assert [data[:2] for _, data in frames] == [b"\x21\x02"]

    def test_with_the_event_timer_it_comes_without_a_change_too(self, wire) -> None:
        configure(wire, ENCODER, kind=254, event=10)
        wire.nmt(0x01, ENCODER)
        assert len(wire.wait(1.0)) == 100

    def test_of_type_0_a_change_goes_out_with_the_next_sync(self, wire) -> None:
        """Type 0: "The TPDO is sent immediately after receipt of the next SYNC message, but only if an event has
        occurred before the SYNC message". TR Electronic, encoTRive manual, page 205 (manualshive.com)."""
        configure(wire, ENCODER, kind=0)
        wire.nmt(0x01, ENCODER)
        wire.send(0x080)
        assert wire.send(0x080) == []
        wire.vehicle.encoders[0].counts = 4711
        assert wire.wait(0.1) == []
        assert wire.send(0x080) == [(0x185, u32(4711))]
        assert wire.send(0x080) == []

    def test_as_delivered_moving_nodes_leave_room_on_the_bus(self, wire) -> None:
        """An inhibit time of 10 ms: 600 frames a second of six nodes, of 9009 that 1 Mbit/s carries."""
        wire.nmt(0x01)
        for shaft in wire.vehicle.drives:
            shaft.speed, shaft.friction = 1.0, 1e-9
        assert len(wire.wait(1.0)) == 4 * 100


class TestMappingCodes:
    """The conformance trace, PDO 31: to map a process output (rww, wo) to a TPDO, "Allowing error codes 0x06020000 or
    0x06040041"; PDO 28: a process input (ro, rwr) to an RPDO, the same; 0609 0011h is a sub-index that is not there
    (Applied Motion, CANopen user manual 920-0025, page 32)."""

    def begin(self, wire, base: int) -> None:
        cob_id = wire.read(DRIVE, base, 1)
        assert wire.write(DRIVE, base, 1, u32(cob_id | 1 << 31)) == 0
        assert wire.write(DRIVE, base + 0x200, 0, b"\x00") == 0

    @pytest.mark.parametrize(
        ("base", "entry", "code"),
        [
            (0x1800, 0x60710010, 0x06040041),
            (0x1800, 0x60400010, 0x06040041),
            (0x1800, 0x00050008, 0x06040041),
            (0x1400, 0x60410010, 0x06040041),
            (0x1400, 0x10010008, 0x06040041),
            (0x1400, 0x60810020, 0),
            (0x1800, 0x10180120, 0x06040041),
            (0x1800, 0x10180920, 0x06090011),
            (0x1800, 0x60410110, 0x06090011),
            (0x1400, 0x60400110, 0x06090011),
            (0x1800, 0x55550010, 0x06020000),
            (0x1800, 0x20100110, 0),
        ],
        ids=lambda value: f"{value:X}",
    )
    def test_an_entry_is_answered_as_the_eds_says(self, wire, base: int, entry: int, code: int) -> None:
        self.begin(wire, base)
        assert wire.write(DRIVE, base + 0x200, 1, u32(entry)) == code

    def test_a_stored_mapping_is_answered_alike_when_it_is_counted(self, wire) -> None:
        """What was not mapped, 0000 0000h, is an object that is not there."""
        self.begin(wire, 0x1800)
        assert wire.write(DRIVE, 0x1A00, 0, b"\x04") == 0x06020000

    def test_the_reserved_sub_index_4_of_a_pdo_is_not_there(self, wire) -> None:
        """It "is reserved. ... read or write access leads to" abort code 0609 0011h. Applied Motion, page 32."""
        assert wire.write(DRIVE, 0x1800, 4, b"\x00") == 0x06090011
        assert wire.abort_code_of_read(DRIVE, 0x1800, 4) == 0x06090011


class TestSynchronousWindow:
    """1007h: "If the synchronous window length expired ... all synchronous RPDOs will be discarded until the next SYNC
    message is received. ... If the value is set to 0 the synchronous window is disabled."
    (drives.novantamotion.com/emcl/0x1007-sync-window-length)."""

    def torque_after(self, wire, window: int, delay: float) -> int:
        """6071h at the SYNC after an RPDO that came `delay` seconds after the one before [s]."""
        wire.make_synchronous(DRIVE)
        wire.nmt(0x01, DRIVE)
        assert wire.write(DRIVE, 0x1007, 0, u32(window)) == 0
        wire.send(0x080)
        wire.wait(delay)
        wire.send(0x201, struct.pack("<Hh", 0x06, 77))
        wire.wait(0.01 - delay)
        wire.send(0x080)
        return wire.read(DRIVE, 0x6071, signed=True)

    @pytest.mark.parametrize(("window", "delay", "torque"), [(3000, 0.002, 77), (3000, 0.004, 0), (0, 0.009, 77)])
    def test_an_rpdo_counts_within_the_window_only(self, wire, window: int, delay: float, torque: int) -> None:
        assert self.torque_after(wire, window, delay) == torque

    def test_the_next_sync_opens_it_again(self, wire) -> None:
        assert self.torque_after(wire, 3000, 0.004) == 0
        wire.send(0x201, struct.pack("<Hh", 0x06, 78))
        wire.send(0x080)
        assert wire.read(DRIVE, 0x6071, signed=True) == 78

    def test_rpdos_that_need_no_sync_need_no_window(self, wire) -> None:
        wire.write(DRIVE, 0x1007, 0, u32(1000))
        wire.nmt(0x01, DRIVE)
        wire.wait(0.5)
        wire.send(0x201, struct.pack("<Hh", 0x06, 79))
        assert wire.read(DRIVE, 0x6071, signed=True) == 79


class TestTime:
    """1012h: "bit 31: If set, CANopen device consumes TIME message, bit 30: produces" (CANopenNode, NodeSlave.xdd). A
    TIME message has milliseconds after midnight in 28 bits and days since 1984-01-01 in 16 (CiA 301, 7.2.6)."""

    def consume(self, wire, node_id: int) -> None:
        assert wire.write(node_id, 0x1012, 0, u32(0x80000100)) == 0

    def clock(self, wire, node_id: int) -> tuple[int, int]:
        return wire.read(node_id, 0x2010, 1), wire.read(node_id, 0x2010, 2)

    @pytest.mark.parametrize("node_id", [DRIVE, ENCODER])
    def test_the_clock_is_set_and_goes_on(self, wire, node_id: int) -> None:
        self.consume(wire, node_id)
        wire.send(0x100, NOON)
        assert self.clock(wire, node_id) == (15_000, 43_200_000)
        wire.wait(1.5)
        assert self.clock(wire, node_id) == (15_000, 43_201_500)

    def test_the_day_ends_at_midnight(self, wire) -> None:
        self.consume(wire, DRIVE)
        wire.send(0x100, struct.pack("<IH", 86_399_999, 3))
        wire.wait(0.002)
        assert self.clock(wire, DRIVE) == (4, 1)

    def test_as_delivered_nobody_listens(self, wire) -> None:
        wire.send(0x100, NOON)
        assert self.clock(wire, DRIVE)[0] == 0

    @pytest.mark.parametrize("data", [NOON[:5], NOON + b"\x00", struct.pack("<IH", 86_400_000, 1)])
    def test_what_is_no_time_of_day_is_ignored(self, wire, data: bytes) -> None:
        self.consume(wire, DRIVE)
        wire.send(0x100, data)
        assert self.clock(wire, DRIVE)[0] == 0

    def test_the_reserved_bits_of_the_milliseconds_count_for_nothing(self, wire) -> None:
        self.consume(wire, DRIVE)
        wire.send(0x100, struct.pack("<IH", 0xF0000000 | 1000, 7))
        assert self.clock(wire, DRIVE) == (7, 1000)

    def test_a_stopped_node_takes_none(self, wire) -> None:
        self.consume(wire, DRIVE)
        wire.nmt(0x02, DRIVE)
        wire.send(0x100, NOON)
        wire.nmt(0x80, DRIVE)
        assert self.clock(wire, DRIVE)[0] == 0

    def test_these_nodes_produce_none(self, wire) -> None:
        assert wire.write(DRIVE, 0x1012, 0, u32(0x40000100)) == 0x06090030

    def test_the_identifier_changes_only_while_it_is_not_consumed(self, wire) -> None:
        self.consume(wire, DRIVE)
        assert wire.write(DRIVE, 0x1012, 0, u32(0x80000190)) == 0x06090030
        assert wire.write(DRIVE, 0x1012, 0, u32(0x00000190)) == 0
        assert wire.write(DRIVE, 0x1012, 0, u32(0x80000190)) == 0
        wire.send(0x100, MIDNIGHT)
        wire.send(0x190, NOON)
        assert self.clock(wire, DRIVE) == (15_000, 43_200_000)

    def test_a_reset_of_the_communication_leaves_the_clock_and_one_of_the_node_does_not(self, wire) -> None:
        self.consume(wire, DRIVE)
        wire.send(0x100, NOON)
        wire.nmt(0x82, DRIVE)
        assert self.clock(wire, DRIVE)[0] == 15_000
        wire.nmt(0x81, DRIVE)
        assert self.clock(wire, DRIVE) == (0, 0)


def test_a_node_without_supply_sends_nothing_of_its_trip(wire) -> None:
    """An EMCY needs pre-operational or operational (CiA 301, table 38)."""
    wire.devices.power_off(DRIVE)
    wire.frames()
    wire.vehicle.drives[0].trip(Trip.OVER_CURRENT)
    assert wire.frames() == []

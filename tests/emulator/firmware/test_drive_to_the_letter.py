"""CiA 402-2 object by object, where drives are known to differ; each test names a source that anybody can reach."""

from __future__ import annotations

import math
import struct
from itertools import pairwise

import pytest

from emulator.firmware.drive.modes import Mode
from emulator.power_stage import Trip

COUNTS = 1048576
TARGET_REACHED, LIMIT, BIT_12 = 1 << 10, 1 << 11, 1 << 12
REMOTE = 1 << 9
START, HALT = 1 << 4, 1 << 8
ENABLE = 0x0F
LOWEST, HIGHEST = -(2**31), 2**31 - 1


class Drive:
    """One drive of the wire, by its objects."""

    def __init__(self, wire) -> None:
        self.wire = wire
        self.shaft = wire.vehicle.drives[0]
        self.put(0x60F9, "<I", 1_000_000, 3)

    def put(self, index: int, code: str, value: int, subindex: int = 0) -> int:
        return self.wire.write(1, index, subindex, struct.pack(code, value))

    def get(self, index: int, signed: bool = True, subindex: int = 0) -> int:
        return self.wire.read(1, index, subindex, signed=signed)

    def control(self, controlword: int) -> None:
        assert self.put(0x6040, "<H", controlword) == 0

    def enable(self, mode: Mode) -> None:
        self.wire.nmt(0x01, 1)
        assert self.put(0x6060, "<b", mode) == 0
        for controlword in (0x06, ENABLE):
            self.control(controlword)
        assert self.status & 0x6F == 0x27

    @property
    def status(self) -> int:
        return self.get(0x6041, signed=False)

    def wait(self, duration: float) -> None:
        self.wire.wait(duration)


@pytest.fixture
def drive(wire) -> Drive:
    return Drive(wire)


class TestBitNineOfTheStatusword:
    """6041h, bit 9: "If the bit remote is reset, then the drive is in local mode and will not execute the command
    message. ... The drive will accept accesses via SDO in local mode." Parker, TWIN-N and SPD-N user's manual, page 150
    (easymanua.ls/parker/twin-n-series)."""

    def test_in_pre_operational_a_controlword_is_taken_and_not_processed(self, drive: Drive) -> None:
        assert not drive.status & REMOTE
        drive.control(0x06)
        assert drive.get(0x6040) == 0x06
        assert drive.status & 0x6F == 0x40

    def test_what_was_not_processed_does_not_come_into_force_later(self, drive: Drive) -> None:
        drive.control(0x06)
        drive.wire.nmt(0x01, 1)
        drive.wait(0.1)
        assert drive.status & (REMOTE | 0x6F) == REMOTE | 0x40
        drive.control(0x06)
        assert drive.status & 0x6F == 0x21

    def test_a_set_point_wakes_no_bit_that_was_not_processed(self, drive: Drive) -> None:
        """6007h = 0 lets the drive run on in pre-operational; a bit 4 that it has not processed starts no homing."""
        drive.put(0x6007, "<h", 0)
        drive.enable(Mode.HOMING)
        drive.shaft.angle = 1.0
        position = drive.get(0x6064)
        drive.wire.nmt(0x80, 1)
        drive.control(ENABLE | START)
        drive.put(0x60FF, "<i", 5)
        drive.wait(0.05)
        assert drive.get(0x6064) == pytest.approx(position, abs=10)
        assert position != 0

    def test_a_fault_is_reset_where_the_drive_is_remote(self, drive: Drive) -> None:
        drive.shaft.trip(Trip.OVER_CURRENT)
        drive.control(0x80)
        assert drive.status & 0x4F == 0x08
        drive.wire.nmt(0x01, 1)
        drive.control(0x80)
        assert drive.status & 0x4F == 0x40


class TestHoming:
    """6040h, bit 4 in homing mode: "0 -> 1 homing motion starts, 1 -> 0 homing motion stops". Leadshine, EL8-EC user
    manual, page 196 (manualshive.com/en/manual/leadshine/el8-ec-series)."""

    def homed(self, drive: Drive) -> None:
        """Method 37: where the shaft is now is the home position."""
        drive.enable(Mode.HOMING)
        drive.control(ENABLE | START)
        assert drive.status & (TARGET_REACHED | BIT_12) == TARGET_REACHED | BIT_12
        assert drive.get(0x6064) == 0

    def test_a_bit_that_is_high_when_operation_is_enabled_starts_nothing(self, drive: Drive) -> None:
        drive.wire.nmt(0x01, 1)
        drive.put(0x6060, "<b", Mode.HOMING)
        drive.shaft.angle = 1.0
        drive.control(0x06)
        drive.control(ENABLE | START)
        drive.wait(0.05)
        assert drive.get(0x6064) == round(COUNTS / math.tau - 0.5)
        assert drive.status & (TARGET_REACHED | BIT_12) == TARGET_REACHED, "not started"
        drive.control(ENABLE)
        drive.control(ENABLE | START)
        assert drive.get(0x6064) == 0

    @pytest.mark.parametrize("way", ["again", "halt", "mode", "disable", "quick stop"])
    def test_a_position_is_not_zeroed_twice_by_one_edge(self, drive: Drive, way: str) -> None:
        drive.put(0x605A, "<h", 6)
        self.homed(drive)
        drive.shaft.angle += 1.0
        position = drive.get(0x6064)
        ways = {
            "again": [ENABLE | START],
            "halt": [ENABLE | START | HALT, ENABLE | START],
            "disable": [0x07 | START, ENABLE | START],
            "quick stop": [0x02 | START, ENABLE | START],
        }
        if way == "mode":
            drive.put(0x6060, "<b", Mode.PROFILE_VELOCITY)
            drive.put(0x6060, "<b", Mode.HOMING)
        for controlword in ways.get(way, []):
            drive.control(controlword)
            drive.wait(0.05)
        assert drive.status & 0x6F == 0x27
        assert drive.get(0x6064) == pytest.approx(position, abs=100)

    def test_the_next_edge_zeroes_it_again(self, drive: Drive) -> None:
        self.homed(drive)
        drive.shaft.angle += 1.0
        drive.control(ENABLE)
        drive.control(ENABLE | START)
        assert drive.get(0x6064) == 0


class TestSupportedHomingMethods:
    """60E3h lists what 6098h takes. Novanta, EMCL registers (drives.novantamotion.com/emcl)."""

    def test_every_method_in_the_list_is_taken_and_no_other(self, drive: Drive) -> None:
        listed = {drive.get(0x60E3, subindex=k) for k in range(1, drive.get(0x60E3) + 1)}
        taken = {method for method in range(-128, 128) if drive.put(0x6098, "<b", method) == 0}
        assert taken - {0} == listed

    def test_a_method_that_is_refused_is_not_used(self, drive: Drive) -> None:
        assert drive.put(0x6098, "<b", 1) == 0x06090030
        drive.enable(Mode.HOMING)
        drive.control(ENABLE | START)
        assert drive.status & BIT_12, "method 37 as delivered: here and at once"


class TestStepsInCyclicSynchronousPosition:
    """607Ah in cyclic synchronous position: "Following error window ... If the actual position is outside of this
    corridor for longer", and 607Fh, 60C5h bound the demand. Nanotec, N5 EtherCAT technical manual, "Cyclic Synchronous
    Position" (us.nanotec.com); Yaskawa, SGD7S product manual, page 486, on 607Fh."""

    def demands(self, drive: Drive, step: int, duration: float) -> list[int]:
        """6062h in every millisecond after a step."""
        drive.enable(Mode.CYCLIC_POSITION)
        drive.put(0x607A, "<i", 0)
        drive.wait(0.01)
        drive.put(0x607A, "<i", step)
        found = []
        for _ in range(round(duration * 1000)):
            drive.wait(0.001)
            found.append(drive.get(0x6062))
        return found

    def test_a_step_is_no_faster_than_607fh(self, drive: Drive) -> None:
        drive.put(0x607F, "<I", COUNTS)
        demands = self.demands(drive, COUNTS // 2, 0.7)
        assert max(b - a for a, b in pairwise(demands)) <= COUNTS // 1000 + 1
        assert demands[-1] == COUNTS // 2

    def test_a_step_changes_the_speed_no_faster_than_60c5h(self, drive: Drive) -> None:
        limit = 100 * COUNTS
        drive.put(0x60C5, "<I", limit)
        drive.put(0x60C6, "<I", limit)
        demands = self.demands(drive, COUNTS, 0.5)
        speeds = [(b - a) * 1000 for a, b in pairwise(demands)]
        assert max(abs(b - a) for a, b in pairwise(speeds)) <= limit / 1000 + 2000
        assert demands[-1] == COUNTS

    def test_a_step_that_is_cut_shows_in_bit_11(self, drive: Drive) -> None:
        drive.put(0x607F, "<I", COUNTS)
        self.demands(drive, COUNTS, 0.1)
        assert drive.status & LIMIT

    def test_a_step_that_the_shaft_cannot_follow_is_fault_8611(self, drive: Drive) -> None:
        drive.put(0x6065, "<I", COUNTS // 100)
        drive.put(0x6066, "<H", 20)
        drive.shaft.inertia = 10.0
        self.demands(drive, 10 * COUNTS, 0.5)
        assert drive.status & 0x4F == 0x08
        assert drive.get(0x603F, signed=False) == 0x8611


class TestTargetReachedInProfileTorque:
    """6041h, bit 10: "If bit 10 is set by the drive, then a set-point has been reached"; bit 11: "an internal
    limitation is active". Parker, TWIN-N and SPD-N user's manual, page 150 (easymanua.ls/parker/twin-n-series)."""

    @pytest.mark.parametrize("limit", [0x6072, 0x6073, 0x60E0])
    def test_a_target_beyond_a_limit_is_not_reached(self, drive: Drive, limit: int) -> None:
        drive.put(limit, "<H", 150)
        drive.enable(Mode.PROFILE_TORQUE)
        drive.put(0x6071, "<h", 600)
        drive.wait(0.2)
        assert drive.get(0x6074) == 150
        assert drive.status & (TARGET_REACHED | LIMIT) == LIMIT
        drive.put(0x6071, "<h", 150)
        drive.wait(0.01)
        assert drive.status & (TARGET_REACHED | LIMIT) == TARGET_REACHED

    def test_the_ramp_does_not_run_on_beyond_the_limit(self, drive: Drive) -> None:
        """At 6087h = 1000 per mille a second, back from 150 to 100 takes 50 ms, however long 600 was asked for."""
        drive.put(0x6072, "<H", 150)
        drive.put(0x6087, "<I", 1000)
        drive.enable(Mode.PROFILE_TORQUE)
        drive.put(0x6071, "<h", 600)
        drive.wait(1.0)
        drive.put(0x6071, "<h", 100)
        drive.wait(0.052)
        assert drive.get(0x6074) == 100

    def test_a_motor_at_its_highest_speed_has_not_reached_a_torque_that_it_must_not_give(self, drive: Drive) -> None:
        drive.put(0x6080, "<I", 955)
        drive.enable(Mode.PROFILE_TORQUE)
        drive.put(0x6071, "<h", 500)
        drive.wait(2.0)
        assert drive.status & (TARGET_REACHED | LIMIT) == LIMIT


class TestSoftwarePositionLimit:
    """607Dh: "Every new target position will be checked and adjusted to the limits ... always related to the home
    position" (drives.novantamotion.com/emcl/0x607d-software-position-limit); off where the lower is not below the upper
    (Yaskawa, SGD7S product manual, page 486); in cyclic synchronous position bit 11 shows it (Nanotec, N5 manual)."""

    def limit(self, drive: Drive, low: int, high: int) -> None:
        drive.put(0x607D, "<i", low, 1)
        drive.put(0x607D, "<i", high, 2)

    def test_as_delivered_no_position_is_beyond_it(self, drive: Drive) -> None:
        assert [drive.get(0x607D, subindex=k) for k in (1, 2)] == [LOWEST, HIGHEST]

    @pytest.mark.parametrize("sign", [1, -1])
    def test_a_target_of_profile_position_is_adjusted(self, drive: Drive, sign: int) -> None:
        self.limit(drive, -COUNTS, COUNTS)
        drive.enable(Mode.PROFILE_POSITION)
        drive.put(0x607A, "<i", sign * 3 * COUNTS)
        drive.control(ENABLE | START)
        drive.wait(1.0)
        assert drive.get(0x6062) == sign * COUNTS
        assert drive.status & (TARGET_REACHED | LIMIT) == TARGET_REACHED | LIMIT
        drive.control(ENABLE)
        drive.put(0x607A, "<i", 0)
        drive.control(ENABLE | START)
        drive.wait(1.0)
        assert drive.status & (TARGET_REACHED | LIMIT) == TARGET_REACHED

    @pytest.mark.parametrize("offset", [0, 5 * COUNTS])
    def test_it_counts_from_the_home_position(self, drive: Drive, offset: int) -> None:
        self.limit(drive, -COUNTS, COUNTS)
        drive.put(0x607C, "<i", offset)
        drive.enable(Mode.HOMING)
        drive.control(ENABLE | START)
        assert drive.get(0x6064) == offset
        drive.put(0x6060, "<b", Mode.PROFILE_POSITION)
        drive.control(ENABLE)
        drive.put(0x607A, "<i", 100 * COUNTS)
        drive.control(ENABLE | START)
        drive.wait(1.0)
        assert drive.get(0x6062) == offset + COUNTS

    def test_a_set_point_of_cyclic_position_is_adjusted(self, drive: Drive) -> None:
        self.limit(drive, 0, COUNTS // 10)
        drive.enable(Mode.CYCLIC_POSITION)
        for k in range(200):
            drive.put(0x607A, "<i", k * COUNTS // 1000)
            drive.wait(0.002)
        assert drive.get(0x6062) == COUNTS // 10
        assert drive.status & LIMIT

    def test_limits_the_wrong_way_round_are_none(self, drive: Drive) -> None:
        self.limit(drive, 0, 0)
        drive.enable(Mode.PROFILE_POSITION)
        drive.put(0x607A, "<i", COUNTS)
        drive.control(ENABLE | START)
        drive.wait(1.0)
        assert drive.get(0x6062) == COUNTS


class TestPolarity:
    """607Eh: bit 7 multiplies positions by -1, bit 6 velocities; "The polarity flag has no influence on the homing
    mode". Synapticon, Circulo 7 manual, page 781 (easymanua.ls/synapticon/circulo-7)."""

    POSITION, VELOCITY = 0x80, 0x40

    def test_a_reversed_position_turns_the_shaft_the_other_way(self, drive: Drive) -> None:
        assert drive.put(0x607E, "<B", self.POSITION) == 0
        drive.enable(Mode.PROFILE_POSITION)
        drive.put(0x607A, "<i", COUNTS)
        drive.control(ENABLE | START)
        drive.wait(1.0)
        assert drive.shaft.angle == pytest.approx(-math.tau, rel=1e-2)
        assert drive.get(0x6064) == pytest.approx(COUNTS, rel=1e-2)
        assert drive.get(0x6062) == COUNTS
        assert drive.status & TARGET_REACHED

    def test_in_cyclic_position_demand_and_error_are_reversed_too(self, drive: Drive) -> None:
        drive.put(0x607E, "<B", self.POSITION | self.VELOCITY)
        drive.enable(Mode.CYCLIC_POSITION)
        for k in range(250):
            drive.put(0x607A, "<i", -k * COUNTS // 500)
            drive.wait(0.002)
        assert drive.shaft.speed == pytest.approx(math.tau, rel=0.05)
        assert drive.get(0x606C) == pytest.approx(-COUNTS, rel=0.05)
        assert drive.get(0x60F4) == pytest.approx(drive.get(0x6062) - drive.get(0x6064), abs=COUNTS // 500)

    @pytest.mark.parametrize("mode", [Mode.PROFILE_VELOCITY, Mode.CYCLIC_VELOCITY])
    def test_a_reversed_velocity_leaves_the_position_alone(self, drive: Drive, mode: Mode) -> None:
        drive.put(0x607E, "<B", self.VELOCITY)
        drive.enable(mode)
        drive.put(0x60FF, "<i", COUNTS)
        drive.wait(0.5)
        assert drive.shaft.speed == pytest.approx(-math.tau, rel=1e-2)
        assert drive.get(0x606C) == pytest.approx(COUNTS, rel=1e-2)
        assert drive.get(0x606B) == COUNTS
        assert drive.get(0x6064) < 0

    def test_homing_is_not_reversed(self, drive: Drive) -> None:
        drive.put(0x607E, "<B", self.POSITION | self.VELOCITY)
        drive.put(0x6098, "<b", 34)
        drive.put(0x607C, "<i", 1000)
        drive.shaft.angle = 1.0
        drive.enable(Mode.HOMING)
        drive.control(ENABLE | START)
        drive.wait(0.2)
        assert drive.shaft.speed > 0.0, "method 34 seeks in the positive direction of the motor"
        drive.wait(1.5)
        beyond = drive.shaft.angle - math.tau
        assert drive.get(0x6064) == pytest.approx(1000 - beyond / math.tau * COUNTS, abs=2)

    def test_the_most_negative_count_has_no_counterpart_and_is_no_trouble(self, drive: Drive) -> None:
        drive.put(0x607E, "<B", self.POSITION)
        drive.shaft.angle = -2048.0 * math.tau
        assert drive.get(0x6064) == LOWEST

    def test_reserved_bits_and_a_change_while_it_moves_are_refused(self, drive: Drive) -> None:
        assert drive.put(0x607E, "<B", 0x01) == 0x06090030
        drive.enable(Mode.PROFILE_VELOCITY)
        assert drive.put(0x607E, "<B", self.VELOCITY) == 0x08000022
        assert drive.get(0x607E) == 0


class TestPositioningOptionCode:
    """60F2h, bits 0 and 1: a relative target counts from the preceding target (0), the output of the ramp generator (1)
    or 6064h (2). Nanotec, PD4-E technical manual, page 283 (manualshive.com/en/manual/nanotec/pd4-e)."""

    RELATIVE = 1 << 6 | 1 << 5

    def moved(self, drive: Drive, option: int) -> tuple[int, int, int]:
        """Demand and position when a second, relative set-point comes on the way to the first; where it ends."""
        assert drive.put(0x60F2, "<H", option) == 0
        # A heavy shaft keeps 6064h well behind 6062h.
        drive.shaft.inertia = 0.05
        drive.put(0x6065, "<I", 0xFFFFFFFF)
        drive.enable(Mode.PROFILE_POSITION)
        drive.put(0x607A, "<i", 4 * COUNTS)
        drive.control(ENABLE | START)
        drive.wait(0.3)
        drive.control(ENABLE)
        demand, position = drive.get(0x6062), drive.get(0x6064)
        drive.put(0x607A, "<i", COUNTS)
        drive.control(ENABLE | START | self.RELATIVE)
        drive.wait(3.0)
        return demand, position, drive.get(0x6062)

    def test_0_counts_from_the_preceding_target(self, drive: Drive) -> None:
        assert self.moved(drive, 0)[2] == 5 * COUNTS

    def test_1_counts_from_the_demand(self, drive: Drive) -> None:
        demand, _, end = self.moved(drive, 1)
        assert end == pytest.approx(demand + COUNTS, abs=2)
        assert demand < 4 * COUNTS

    def test_2_counts_from_the_position(self, drive: Drive) -> None:
        demand, position, end = self.moved(drive, 2)
        assert end == pytest.approx(position + COUNTS, abs=2)
        assert position < demand - COUNTS // 10

    @pytest.mark.parametrize("value", [3, 1 << 2, 1 << 4, 1 << 6, 1 << 15])
    def test_options_that_there_are_not_are_refused(self, drive: Drive, value: int) -> None:
        assert drive.put(0x60F2, "<H", value) == 0x06090030


class TestDigitalInputs:
    """60FDh: bit 0 negative limit switch, bit 1 positive limit switch, bit 2 home switch, bit 3 interlock. Kinco, FD5
    manual, page 190 (easymanua.ls/kinco/fd5-series). A wheel has none of them."""

    def test_no_switch_is_active_and_a_tpdo_may_carry_them(self, drive: Drive) -> None:
        assert drive.get(0x60FD) == 0
        assert drive.put(0x1801, "<I", 0xC0000281, 1) == 0
        assert drive.put(0x1A01, "<B", 0) == 0
        assert drive.put(0x1A01, "<I", 0x60FD0020, 1) == 0


class TestTrips:
    """Transition 13 comes "automatically" from every state when a fault is detected, and 603Fh is the last error.
    Synapticon, Circulo 7 manual, "State machine" (easymanua.ls/synapticon/circulo-7)."""

    def test_a_second_trip_in_fault_is_told_and_is_the_last_error(self, drive: Drive) -> None:
        drive.wire.nmt(0x01, 1)
        drive.shaft.trip(Trip.OVER_VOLTAGE)
        drive.wire.frames()
        drive.shaft.trip(Trip.OVER_CURRENT)
        assert [data[:2] for can_id, data in drive.wire.frames() if can_id == 0x081] == [b"\x10\x23"]
        assert drive.get(0x603F, signed=False) == 0x2310
        assert drive.status & 0x4F == 0x08

    def test_a_drive_without_supply_finds_it_at_boot(self, drive: Drive) -> None:
        drive.wire.devices.power_off(1)
        drive.shaft.trip(Trip.OVER_CURRENT)
        drive.wire.frames()
        drive.wire.devices.power_on(1)
        frames = drive.wire.frames()
        assert frames[0] == (0x701, b"\x00")
        assert (0x081, b"\x10\x23\x03" + bytes(5)) in frames
        assert drive.status & 0x4F == 0x08

    def test_a_reset_of_a_drive_that_runs_leaves_no_fault_behind(self, drive: Drive) -> None:
        drive.enable(Mode.PROFILE_VELOCITY)
        drive.wire.nmt(0x81, 1)
        assert drive.status & 0x4F == 0x40


def test_operation_that_goes_on_before_its_ramp_is_over_shows_that_it_follows(drive: Drive) -> None:
    """6041h, bit 12 in cyclic synchronous modes: the controller follows the target (Nanotec, N5 manual). 605Ch = 1 puts
    off transition 5; enable operation before its end takes it back."""
    drive.enable(Mode.CYCLIC_TORQUE)
    drive.put(0x6071, "<h", 500)
    drive.wait(0.01)
    drive.control(0x07)
    drive.wait(0.01)
    assert not drive.status & BIT_12
    drive.control(ENABLE)
    assert drive.status & (BIT_12 | 0x6F) == BIT_12 | 0x27
    assert drive.get(0x6074) == 500

"""A wheel drive, seen through its frames and the shaft it turns."""

from __future__ import annotations

import math
import struct

import pytest

RATED = 1.27
COUNTS = 1048576


def status(frames: list[tuple[int, bytes]], node_id: int = 1) -> tuple[int, int, int]:
    """Statusword, torque in per mille, position from the TPDO1 in `frames`."""
    (data,) = [data for can_id, data in frames if can_id == 0x180 + node_id]
    return struct.unpack("<Hhi", data)


def test_a_drive_enables_by_three_controlwords_and_shows_each_state(wire) -> None:
    wire.make_synchronous(1)
    wire.nmt(0x01, 1)
    assert wire.write(1, 0x6060, 0, b"\x0a") == 0
    seen = [status(wire.command(1, word))[0] & 0x6F for word in (0x00, 0x06, 0x07, 0x0F)]
    assert seen == [0x40, 0x21, 0x23, 0x27]
    assert [drive.enabled for drive in wire.vehicle.drives] == [True, False, False, False]


def test_torque_turns_the_shaft_as_newton_says(wire) -> None:
    wire.enable(1)
    before = status(wire.command(1, 0x0F, 100))[2]
    for _ in range(50):
        wire.wait(0.002)
        frames = wire.send(0x080)
    torque, inertia, friction = 0.1 * RATED, 1e-3, 1e-3
    rate, t = friction / inertia, 50 * 0.002
    angle = torque / friction * (t - (1 - math.exp(-rate * t)) / rate)
    assert (status(frames)[2] - before) / COUNTS * 2 * math.pi == pytest.approx(angle, abs=2e-5)
    assert status(frames)[1] == 100


def test_target_and_controlword_of_one_rpdo_take_effect_together(wire) -> None:
    """The RPDO that enables the drive brings its target along: no cycle runs on the target before it."""
    wire.make_synchronous(1)
    wire.nmt(0x01, 1)
    wire.write(1, 0x6060, 0, b"\x0a")
    wire.command(1, 0x06)
    wire.command(1, 0x07, 999)
    assert wire.vehicle.drives[0].torque == 0.0
    wire.command(1, 0x0F, 50)
    assert wire.vehicle.drives[0].torque == pytest.approx(0.05 * RATED)


def test_a_synchronous_rpdo_waits_for_the_sync(wire) -> None:
    wire.enable(2)
    wire.send(0x202, struct.pack("<Hh", 0x0F, 200))
    assert wire.vehicle.drives[1].torque == 0.0
    wire.send(0x080)
    assert wire.vehicle.drives[1].torque == pytest.approx(0.2 * RATED)


def test_an_event_driven_rpdo_acts_at_once(wire) -> None:
    wire.enable(2)
    assert wire.write(2, 0x1400, 2, b"\xff") == 0
    wire.send(0x202, struct.pack("<Hh", 0x0F, 200))
    assert wire.vehicle.drives[1].torque == pytest.approx(0.2 * RATED)


def test_the_limit_6072h_cuts_the_torque_and_shows_in_bit_eleven(wire) -> None:
    wire.enable(1)
    assert wire.write(1, 0x6072, 0, struct.pack("<H", 300)) == 0
    assert status(wire.command(1, 0x0F, 299))[0] & 0x800 == 0
    word, torque, _ = status(wire.command(1, 0x0F, -500))
    assert word & 0x800
    assert torque == -300
    assert wire.read(1, 0x6074, signed=True) == -300


def test_no_mode_no_torque(wire) -> None:
    wire.make_synchronous(1)
    wire.nmt(0x01, 1)
    for word in (0x06, 0x07, 0x0F):
        wire.command(1, word, 100)
    assert wire.read(1, 0x6041) & 0x6F == 0x27
    assert wire.read(1, 0x6041) & 0x1000 == 0
    assert wire.vehicle.drives[0].torque == 0.0


@pytest.mark.parametrize("mode", [2, 5, 7, 11, -1])
def test_a_mode_that_6502h_does_not_list_is_refused(wire, mode: int) -> None:
    assert wire.write(1, 0x6060, 0, struct.pack("<b", mode)) == 0x06090030
    assert wire.read(1, 0x6061) == 0


def test_ratings_are_those_of_the_hardware(wire) -> None:
    assert wire.read(1, 0x6076) == 1270
    assert wire.read(1, 0x6075) == 2600
    assert wire.read(1, 0x608F, 1) == COUNTS
    assert wire.read(1, 0x6502) == sum(1 << mode - 1 for mode in (1, 3, 4, 6, 8, 9, 10))


def test_the_slow_down_ramp_of_a_torque_mode_takes_the_torque_down_at_6087h_and_then_switches_off(wire) -> None:
    wire.enable(1)
    assert wire.write(1, 0x605A, 0, struct.pack("<h", 1)) == 0
    wire.command(1, 0x0F, 500)
    wire.command(1, 0x02, 500)
    assert wire.read(1, 0x6041) & 0x6F == 0x07
    wire.wait(0.025)
    assert wire.read(1, 0x6074) == pytest.approx(500 - 0.025 * 10000, abs=1)
    wire.wait(0.025)
    assert wire.read(1, 0x6041) & 0x4F == 0x40
    assert not wire.vehicle.drives[0].enabled


def test_a_drive_told_to_stay_in_quick_stop_can_resume(wire) -> None:
    wire.enable(1)
    assert wire.write(1, 0x605A, 0, struct.pack("<h", 6)) == 0
    wire.command(1, 0x02)
    wire.wait(0.5)
    assert wire.read(1, 0x6041) & 0x6F == 0x07
    wire.command(1, 0x0F)
    assert wire.read(1, 0x6041) & 0x6F == 0x27


OPTION_CODES = {0x6007: (0, 3), 0x605A: (0, 8), 0x605B: (0, 1), 0x605C: (0, 1), 0x605D: (1, 4), 0x605E: (0, 4)}


@pytest.mark.parametrize(("index", "allowed"), OPTION_CODES.items())
def test_an_option_code_that_the_standard_does_not_define_is_refused(wire, index: int, allowed: tuple) -> None:
    low, high = allowed
    for value in range(-3, 12):
        refused = wire.write(1, index, 0, struct.pack("<h", value))
        assert refused == (0x06090031 if value > high else 0x06090032 if value < low else 0)


REACTIONS = {0: 0x27, 1: 0x08, 2: 0x40, 3: 0x07}
"""6007h -> state, when the quick stop option code says to stay in quick stop active."""


@pytest.mark.parametrize(("option", "state"), REACTIONS.items())
def test_a_silent_master_leads_to_what_6007h_says(wire, option: int, state: int) -> None:
    wire.enable(1)
    assert wire.write(1, 0x605A, 0, struct.pack("<h", 6)) == 0
    assert wire.write(1, 0x6007, 0, struct.pack("<h", option)) == 0
    assert wire.write(1, 0x1029, 1, b"\x01") == 0
    assert wire.write(1, 0x1016, 1, struct.pack("<I", 127 << 16 | 100)) == 0
    wire.wait(1.0)
    assert wire.read(1, 0x6041) & 0x6F == 0x27, "monitoring starts with the first heartbeat"
    wire.send(0x77F, b"\x05")
    wire.wait(0.099)
    assert wire.read(1, 0x6041) & 0x6F == 0x27
    frames = wire.wait(0.001)
    assert struct.pack("<HB", 0x8130, 0x11) in [data[:3] for can_id, data in frames if can_id == 0x081]
    wire.wait(0.05)
    assert wire.read(1, 0x6041) & 0x6F & (0x4F if state in (0x08, 0x40) else 0x6F) == state
    assert wire.vehicle.drives[0].enabled is (state in (0x27, 0x07))


def test_a_fault_names_its_cause_and_is_reset_by_an_edge(wire) -> None:
    wire.enable(1)
    wire.write(1, 0x1029, 1, b"\x01")
    wire.write(1, 0x1016, 1, struct.pack("<I", 127 << 16 | 100))
    wire.send(0x77F, b"\x05")
    wire.wait(0.2)
    assert wire.read(1, 0x603F) == 0x8130
    assert wire.read(1, 0x1003, 0) >= 1
    assert wire.read(1, 0x1003, 1) & 0xFFFF == 0x8130
    wire.send(0x77F, b"\x05")
    frames = wire.command(1, 0x80)
    assert (0x081, bytes(8)) in frames
    assert wire.read(1, 0x1001) == 0
    assert wire.read(1, 0x6041) & 0x4F == 0x40
    assert wire.read(1, 0x603F) == 0


def test_a_lost_master_makes_the_node_pre_operational_by_default(wire) -> None:
    wire.enable(1)
    wire.write(1, 0x1016, 1, struct.pack("<I", 127 << 16 | 100))
    wire.write(1, 0x1017, 0, struct.pack("<H", 50))
    wire.send(0x77F, b"\x05")
    assert (0x701, b"\x7f") in wire.wait(0.2)


@pytest.mark.parametrize("command", [0x02, 0x80], ids=["stop", "pre-operational"])
def test_leaving_operational_brings_the_shaft_to_rest_and_then_takes_the_power_off(wire, command: int) -> None:
    wire.enable(1)
    wire.command(1, 0x0F, 300)
    wire.wait(0.2)
    drive = wire.vehicle.drives[0]
    assert drive.speed > 50.0
    wire.nmt(command, 1)
    assert drive.enabled
    wire.wait(1.0)
    assert not drive.enabled
    assert abs(drive.speed) < 0.5


def test_a_reset_takes_the_power_off_at_once(wire) -> None:
    wire.enable(1)
    wire.command(1, 0x0F, 300)
    wire.nmt(0x81, 1)
    assert not wire.vehicle.drives[0].enabled
    assert wire.vehicle.drives[0].torque == 0.0


def test_position_wraps_like_the_32_bit_register_it_is(wire) -> None:
    wire.vehicle.drives[0].angle = 2 * math.pi * 3000.25
    expected = (3000 * COUNTS + COUNTS // 4 + 2**31) % 2**32 - 2**31
    assert wire.read(1, 0x6064, signed=True) == pytest.approx(expected, abs=2)


def test_velocity_and_current_can_be_mapped_and_are_physical(wire) -> None:
    wire.enable(1)
    wire.command(1, 0x0F, 1000)
    wire.wait(0.1)
    speed = wire.vehicle.drives[0].speed
    assert wire.read(1, 0x606C, signed=True) == pytest.approx(speed / (2 * math.pi) * COUNTS, rel=1e-6)
    assert wire.read(1, 0x6078, signed=True) == 1000

"""Modes of operation on a flywheel, whose motion is known in closed form."""

from __future__ import annotations

import math
import struct
from itertools import pairwise

import pytest

from emulator.firmware.drive.modes import Mode
from emulator.power_stage import Trip

COUNTS = 1048576
RATED = 1.27
INERTIA = FRICTION = 1e-3
"""Of the flywheels [kg m^2], [Nm s/rad]."""

TARGET_REACHED, LIMIT, BIT_12, BIT_13 = 1 << 10, 1 << 11, 1 << 12, 1 << 13


class Drive:
    """One drive on the wire, commissioned for the inertia that it turns."""

    def __init__(self, wire) -> None:
        self.wire = wire
        self.shaft = wire.vehicle.drives[0]
        # 60F9h: gain 0.15 Nm s/rad, integration time 0.1 s as delivered, and the inertia of the flywheel.
        self.write(0x60F9, 3, round(INERTIA * 1e9), "<I")
        wire.nmt(0x01, 1)

    def write(self, index: int, subindex: int, value: int, code: str) -> None:
        assert self.wire.write(1, index, subindex, struct.pack(code, value)) == 0

    def read(self, index: int, signed: bool = True) -> int:
        return self.wire.read(1, index, 0, signed=signed)

    def enable(self, mode: Mode) -> None:
        self.write(0x6060, 0, mode, "<b")
        for controlword in (0x06, 0x0F):
            self.write(0x6040, 0, controlword, "<H")
        assert self.read(0x6041, signed=False) & 0x6F == 0x27

    @property
    def status(self) -> int:
        return self.read(0x6041, signed=False)

    @property
    def speed(self) -> float:
        """606Ch [rad/s]."""
        return self.read(0x606C) / COUNTS * math.tau

    def wait(self, duration: float) -> None:
        self.wire.wait(duration)


def counts(angle: float) -> int:
    """An angle or a speed [rad, rad/s] in increments."""
    return round(angle / math.tau * COUNTS)


@pytest.fixture
def drive(wire) -> Drive:
    return Drive(wire)


def test_profile_velocity_accelerates_at_6083h_and_slows_down_at_6084h(drive: Drive) -> None:
    drive.write(0x6083, 0, counts(400.0), "<I")
    drive.write(0x6084, 0, counts(100.0), "<I")
    drive.enable(Mode.PROFILE_VELOCITY)
    drive.write(0x60FF, 0, counts(100.0), "<i")
    drive.wait(0.125)
    assert drive.speed == pytest.approx(400.0 * 0.125, rel=0.05)
    assert not drive.status & (TARGET_REACHED | BIT_12)
    drive.wait(0.4)
    assert drive.speed == pytest.approx(100.0, rel=0.005)
    assert drive.status & TARGET_REACHED
    drive.write(0x60FF, 0, 0, "<i")
    drive.wait(0.5)
    assert drive.speed == pytest.approx(100.0 - 100.0 * 0.5, rel=0.05)
    drive.wait(1.5)
    assert drive.status & (TARGET_REACHED | BIT_12) == TARGET_REACHED | BIT_12, "speed 0 is the target"


def test_reversing_first_slows_down_and_then_speeds_up(drive: Drive) -> None:
    drive.write(0x6083, 0, counts(200.0), "<I")
    drive.write(0x6084, 0, counts(1000.0), "<I")
    drive.enable(Mode.PROFILE_VELOCITY)
    drive.write(0x60FF, 0, counts(100.0), "<i")
    drive.wait(2.0)
    drive.write(0x60FF, 0, counts(-100.0), "<i")
    drive.wait(0.1 + 0.25)
    assert drive.read(0x606B) == pytest.approx(counts(-50.0), rel=0.02)


@pytest.mark.parametrize(
    ("index", "value", "code"),
    [(0x607F, counts(60.0), "<I"), (0x6080, round(60.0 / math.tau * 60), "<I")],
    ids=["607Fh max profile velocity", "6080h max motor speed"],
)
def test_speed_limits_hold_and_show(drive: Drive, index: int, value: int, code: str) -> None:
    drive.write(index, 0, value, code)
    drive.enable(Mode.PROFILE_VELOCITY)
    drive.write(0x60FF, 0, counts(-200.0), "<i")
    drive.wait(1.5)
    assert drive.speed == pytest.approx(-60.0, rel=0.01)
    assert drive.status & LIMIT


@pytest.mark.parametrize("limit", [0x60C5, 0x6083])
def test_the_lower_one_of_profile_and_max_acceleration_counts(drive: Drive, limit: int) -> None:
    drive.write(0x6083, 0, counts(1000.0), "<I")
    drive.write(0x60C5, 0, counts(1000.0), "<I")
    drive.write(limit, 0, counts(100.0), "<I")
    drive.enable(Mode.PROFILE_VELOCITY)
    drive.write(0x60FF, 0, counts(200.0), "<i")
    drive.wait(0.5)
    assert drive.read(0x606B) == pytest.approx(counts(50.0), rel=0.01)


def test_profile_torque_climbs_at_the_slope_6087h_and_turns_the_shaft(drive: Drive) -> None:
    drive.write(0x6087, 0, 1000, "<I")
    drive.enable(Mode.PROFILE_TORQUE)
    drive.write(0x6071, 0, 100, "<h")
    drive.wait(0.05)
    assert drive.read(0x6074) == pytest.approx(50, abs=1)
    assert not drive.status & TARGET_REACHED
    drive.wait(0.05)
    assert drive.read(0x6077) == 100
    assert drive.status & TARGET_REACHED
    # J w' + d w = M for a ramp of M and then a constant one, by superposition.
    rate, slope = FRICTION / INERTIA, 0.1 * RATED / 0.1
    speed = slope / FRICTION * (0.1 - (1 - math.exp(-rate * 0.1)) / rate)
    assert drive.speed == pytest.approx(speed, rel=0.02)


LIMITS = [(0x6072, "<H", 1), (0x6073, "<H", 1), (0x60E0, "<H", 1), (0x60E1, "<H", -1)]


@pytest.mark.parametrize(("index", "code", "sign"), LIMITS, ids=["6072h", "6073h", "60E0h", "60E1h"])
@pytest.mark.parametrize("mode", [Mode.PROFILE_TORQUE, Mode.CYCLIC_TORQUE, Mode.PROFILE_VELOCITY])
def test_every_torque_limit_holds_in_every_kind_of_mode(drive: Drive, index, code, sign, mode: Mode) -> None:
    drive.write(index, 0, 150, code)
    drive.write(0x6083, 0, counts(10_000.0), "<I")
    drive.write(0x60C5, 0, counts(10_000.0), "<I")
    drive.enable(mode)
    drive.write(0x6071, 0, sign * 600, "<h")
    drive.write(0x60FF, 0, sign * counts(300.0), "<i")
    drive.wait(0.1)
    assert drive.read(0x6074) == sign * 150
    assert drive.shaft.torque == pytest.approx(sign * 0.15 * RATED)
    assert drive.status & LIMIT


def test_a_torque_mode_does_not_run_away(drive: Drive) -> None:
    """6080h protects the motor in every mode: torque fades out beyond it, but may always brake."""
    drive.write(0x6080, 0, 955, "<I")
    drive.enable(Mode.PROFILE_TORQUE)
    drive.write(0x6071, 0, 500, "<h")
    drive.wait(2.0)
    assert 100.0 < drive.speed < 105.0
    drive.write(0x6071, 0, -500, "<h")
    drive.wait(0.06)
    assert drive.read(0x6074) < 0


def cycle(drive: Drive, index: int, values: list[int]) -> list[float]:
    """One set-point every 2 ms, as a master sends them; the speed after each."""
    speeds = []
    for value in values:
        drive.write(index, 0, value, "<i")
        drive.wait(0.002)
        speeds.append(drive.speed)
    return speeds


def test_cyclic_velocity_follows_a_sine(drive: Drive) -> None:
    drive.enable(Mode.CYCLIC_VELOCITY)
    asked = [30.0 * math.sin(math.tau * 2.0 * k * 0.002) for k in range(1000)]
    speeds = cycle(drive, 0x60FF, [counts(speed) for speed in asked])
    errors = [a - b for a, b in zip(asked[500:], speeds[500:], strict=True)]
    # The loop: J w' = Kp e + Ki int e - d w; its error transfer at 2 Hz, and a period of interpolation.
    s, gain = 1j * math.tau * 2.0, 0.15
    loop = gain * (1 + 10.0 / s) / (INERTIA * s + FRICTION)
    expected = 30.0 * (abs(1 / (1 + loop)) + math.tau * 2.0 * 0.003)
    assert max(map(abs, errors)) < expected
    assert drive.status & BIT_12


def test_velocity_and_torque_offsets_add(drive: Drive) -> None:
    drive.enable(Mode.CYCLIC_VELOCITY)
    drive.write(0x60FF, 0, counts(20.0), "<i")
    drive.write(0x60B1, 0, counts(-50.0), "<i")
    drive.wait(1.0)
    assert drive.speed == pytest.approx(-30.0, rel=0.01)
    drive.write(0x6060, 0, Mode.CYCLIC_TORQUE, "<b")
    drive.write(0x6071, 0, 100, "<h")
    drive.write(0x60B2, 0, -30, "<h")
    assert drive.read(0x6074) == 70


def test_set_points_are_interpolated_over_60c2h(drive: Drive) -> None:
    drive.write(0x60C2, 1, 20, "<B")
    drive.enable(Mode.CYCLIC_VELOCITY)
    drive.write(0x60FF, 0, counts(40.0), "<i")
    demands = []
    for _ in range(22):
        drive.wait(0.001)
        demands.append(drive.read(0x606B) / COUNTS * math.tau)
    assert demands[:20] == pytest.approx([2.0 * k for k in range(1, 21)], rel=1e-3)
    assert demands[20:] == pytest.approx([40.0, 40.0], rel=1e-3)


def test_cyclic_position_follows_and_stays(drive: Drive) -> None:
    drive.enable(Mode.CYCLIC_POSITION)
    path = [counts(5.0 * (1 - math.cos(math.pi * k / 500))) for k in range(501)]
    cycle(drive, 0x607A, path)
    assert abs(drive.read(0x60F4)) < counts(0.05)
    drive.wait(1.0)
    assert drive.read(0x6064) == pytest.approx(path[-1], abs=counts(1e-3))
    assert drive.read(0x6062) == path[-1]
    assert drive.status & (BIT_12 | BIT_13) == BIT_12


def test_cyclic_position_takes_the_short_way_round_the_register(drive: Drive) -> None:
    drive.shaft.angle = math.tau * 2047.99
    drive.enable(Mode.CYCLIC_POSITION)
    start = drive.read(0x6064)
    ahead = [(start + k * 300 + 2**31) % 2**32 - 2**31 for k in range(200)]
    assert any(after < before for before, after in pairwise(ahead)), "the path wraps"
    cycle(drive, 0x607A, ahead)
    drive.wait(1.0)
    assert drive.shaft.angle == pytest.approx(math.tau * (2047.99 + 199 * 300 / COUNTS), abs=1e-3)


def test_a_following_error_that_lasts_is_a_fault(drive: Drive) -> None:
    drive.write(0x6065, 0, counts(1.0), "<I")
    drive.write(0x6066, 0, 50, "<H")
    drive.write(0x6072, 0, 20, "<H")
    drive.enable(Mode.CYCLIC_POSITION)
    drive.write(0x607A, 0, counts(20.0), "<i")
    drive.wait(0.040)
    assert drive.status & 0x6F == 0x27, "the time has not passed yet"
    drive.wait(0.060)
    assert drive.read(0x603F, signed=False) == 0x8611
    drive.wait(3.0)
    assert drive.status & 0x4F == 0x08


def test_no_following_error_is_monitored_with_the_largest_window(drive: Drive) -> None:
    drive.write(0x6065, 0, 2**32 - 1, "<I")
    drive.write(0x6072, 0, 20, "<H")
    drive.enable(Mode.CYCLIC_POSITION)
    drive.write(0x607A, 0, counts(20.0), "<i")
    drive.wait(0.5)
    assert drive.status & 0x6F == 0x27


FAR = 30_600_000
"""Counts from zero at which a vehicle has come to stand: 29 revolutions."""


def stand(drive: Drive, angle: float = FAR / COUNTS * math.tau) -> int:
    """The shaft has been turned without power; its count."""
    drive.shaft.angle, drive.shaft.speed = angle, 0.0
    return drive.read(0x6064)


def test_enabled_in_cyclic_position_the_drive_stays_until_a_target_is_written(drive: Drive) -> None:
    here = stand(drive)
    assert drive.read(0x607A) == here, "the target follows the position"
    drive.enable(Mode.CYCLIC_POSITION)
    drive.wait(1.0)
    assert drive.read(0x6064) == pytest.approx(here, abs=2)
    assert drive.speed == pytest.approx(0.0, abs=1e-6)
    # The offsets of a master that is not there yet push nothing.
    drive.write(0x60B1, 0, counts(20.0), "<i")
    drive.write(0x60B2, 0, 300, "<h")
    drive.wait(0.5)
    assert drive.read(0x6064) == pytest.approx(here, abs=2)
    drive.write(0x60B1, 0, 0, "<i")
    drive.write(0x60B2, 0, 0, "<h")
    drive.write(0x607A, 0, here + 1000, "<i")
    drive.wait(1.0)
    assert drive.read(0x6064) == pytest.approx(here + 1000, abs=2)


def test_a_target_from_before_the_power_came_is_not_gone_to(drive: Drive) -> None:
    drive.enable(Mode.CYCLIC_POSITION)
    drive.write(0x607A, 0, counts(1.0), "<i")
    drive.wait(1.0)
    drive.write(0x6040, 0, 0x06, "<H")
    here = stand(drive)
    drive.write(0x607A, 0, 0, "<i")
    drive.enable(Mode.CYCLIC_POSITION)
    drive.wait(1.0)
    assert drive.read(0x6064) == pytest.approx(here, abs=2)


def test_a_change_to_cyclic_position_in_motion_comes_to_rest_at_60c6h_and_stays(drive: Drive) -> None:
    drive.write(0x60C6, 0, counts(500.0), "<I")
    drive.enable(Mode.PROFILE_VELOCITY)
    drive.write(0x60FF, 0, counts(50.0), "<i")
    drive.wait(2.0)
    start, before = drive.shaft.angle, drive.speed
    drive.write(0x6060, 0, Mode.CYCLIC_POSITION, "<b")
    speeds = []
    for _ in range(1000):
        drive.wait(0.001)
        speeds.append(drive.speed)
    assert min(after - earlier for earlier, after in pairwise([before, *speeds])) > -1.0, "0.5 rad/s a tick, and lag"
    assert drive.shaft.angle - start == pytest.approx(50.0**2 / 2 / 500.0, rel=0.1)
    assert drive.speed == pytest.approx(0.0, abs=0.01)


def demands(drive: Drive, ticks: int) -> list[float]:
    """6062h in each tick [increments]."""
    found = []
    for _ in range(ticks):
        drive.wait(0.001)
        found.append(drive.read(0x6062))
    return found


@pytest.mark.parametrize("way", [0.0002, 0.01, 0.3, 5.0, 100.0, -20.0])
@pytest.mark.parametrize(("up", "down"), [(500.0, 250.0), (100.0, 2000.0), (1582.0, 1582.0)])
def test_a_step_of_the_target_is_gone_at_60c5h_60c6h_and_6080h(
    drive: Drive, way: float, up: float, down: float
) -> None:
    drive.write(0x60C5, 0, counts(up), "<I")
    drive.write(0x60C6, 0, counts(down), "<I")
    drive.write(0x6080, 0, round(200.0 / math.tau * 60), "<I")
    drive.write(0x6065, 0, 2**32 - 1, "<I")
    here = stand(drive)
    drive.enable(Mode.CYCLIC_POSITION)
    drive.write(0x607A, 0, here + counts(way), "<i")
    path = demands(drive, 3000)
    slopes = [(after - before) * 1000.0 / COUNTS * math.tau for before, after in pairwise([here, *path])]
    changes = [(after - before) * 1000.0 for before, after in pairwise([0.0, *slopes, 0.0])]
    # A change of slope within an interpolation time of 2 ms is that of one line to the next; rounding is of a count.
    assert max(map(abs, changes)) < 2.0 * max(up, down) + 20.0
    assert max(map(abs, slopes)) < 200.0 * 1.001
    assert path[-1] == here + counts(way)
    beyond = max((position - path[-1]) * math.copysign(1.0, way) for position in path)
    assert beyond <= 1.0, "it is not passed"
    # As fast as the limits allow: a trapezoid or a triangle, and two interpolation times.
    top = min(200.0, math.sqrt(2.0 * abs(way) * up * down / (up + down)))
    fastest = top / up + top / down + max(abs(way) - top**2 / 2 / up - top**2 / 2 / down, 0.0) / top
    taken = next(k for k, position in enumerate(path) if position == path[-1]) * 1e-3
    assert taken < fastest * 1.02 + 0.006


def test_a_path_within_the_limits_is_followed_as_if_there_were_none(drive: Drive) -> None:
    drive.enable(Mode.CYCLIC_POSITION)
    path = [counts(30.0 * (1 - math.cos(math.tau * k / 500))) for k in range(1000)]
    behind = []
    for value in path:
        drive.write(0x607A, 0, value, "<i")
        drive.wait(0.002)
        behind.append(abs(drive.read(0x6062) - value))
    # 30 (2 pi)^2 = 1184 rad/s^2 of 1582 are asked for.
    assert max(behind) <= 1
    assert not drive.status & LIMIT


def test_a_path_is_met_again_after_a_set_point_that_was_lost(drive: Drive) -> None:
    drive.write(0x6065, 0, 2**32 - 1, "<I")
    drive.enable(Mode.CYCLIC_POSITION)
    behind = []
    for k in range(1000):
        target = counts(100.0 * (k * 0.002) ** 2 / (1.0 + k * 0.002))
        if not 500 <= k < 520:
            drive.write(0x607A, 0, target, "<i")
        drive.wait(0.002)
        behind.append(drive.read(0x6062) - target)
    assert max(map(abs, behind[500:525])) > counts(1.0)
    assert max(map(abs, behind[600:])) <= 2


@pytest.mark.parametrize("mode", [Mode.PROFILE_VELOCITY, Mode.CYCLIC_VELOCITY, Mode.CYCLIC_TORQUE, Mode.PROFILE_TORQUE])
def test_what_was_asked_for_before_a_fault_is_forgotten(drive: Drive, mode: Mode) -> None:
    drive.enable(mode)
    drive.write(0x60FF, 0, counts(20.0), "<i")
    drive.write(0x60B1, 0, counts(5.0), "<i")
    drive.write(0x6071, 0, 100, "<h")
    drive.write(0x60B2, 0, 50, "<h")
    drive.wait(0.5)
    assert drive.speed > 5.0
    drive.shaft.trip(Trip.OVER_CURRENT)
    stand(drive, 0.0)
    drive.write(0x6040, 0, 0x80, "<H")
    assert [drive.read(index) for index in (0x60FF, 0x60B1, 0x6071, 0x60B2)] == [0, 0, 0, 0]
    drive.enable(mode)
    drive.wait(1.0)
    assert drive.speed == pytest.approx(0.0, abs=1e-3)


def test_what_was_asked_for_before_a_quick_stop_is_forgotten_and_before_a_shutdown_is_not(drive: Drive) -> None:
    drive.enable(Mode.PROFILE_VELOCITY)
    for controlword, left in ((0x06, counts(20.0)), (0x02, 0)):
        drive.write(0x60FF, 0, counts(20.0), "<i")
        drive.write(0x6040, 0, controlword, "<H")
        drive.wait(2.0)
        drive.enable(Mode.PROFILE_VELOCITY)
        assert drive.read(0x60FF) == left


def test_a_position_profile_without_a_target_goes_nowhere(drive: Drive) -> None:
    here = stand(drive)
    drive.enable(Mode.PROFILE_POSITION)
    for controlword in (0x1F, 0x0F, 0x5F):
        drive.write(0x6040, 0, controlword, "<H")
        drive.wait(0.5)
        assert drive.read(0x6064) == pytest.approx(here, abs=2)


NEW, NOW, RELATIVE = 0x1F, 0x3F, 0x5F
"""Operation enabled with a new set-point; at once; relative."""


def position(drive: Drive) -> float:
    """6064h [rad]."""
    return drive.read(0x6064) / COUNTS * math.tau


def positioning(drive: Drive, speed: float = 50.0, acceleration: float = 500.0, deceleration: float = 250.0) -> None:
    drive.write(0x6081, 0, counts(speed), "<I")
    drive.write(0x6083, 0, counts(acceleration), "<I")
    drive.write(0x6084, 0, counts(deceleration), "<I")
    drive.enable(Mode.PROFILE_POSITION)


def go(drive: Drive, target: float, controlword: int = NEW) -> None:
    """The handshake of the standard: set-point, bit 4, acknowledge, bit 4 back."""
    drive.write(0x607A, 0, counts(target), "<i")
    drive.write(0x6040, 0, controlword, "<H")
    assert drive.status & BIT_12, "acknowledged"
    drive.write(0x6040, 0, 0x0F, "<H")


@pytest.mark.parametrize(("way", "top"), [(40.0, 50.0), (-40.0, 50.0), (3.0, None)], ids=["there", "back", "short"])
def test_a_profile_is_a_trapezoid_or_a_triangle(drive: Drive, way: float, top: float | None) -> None:
    positioning(drive)
    go(drive, way)
    assert not drive.status & (TARGET_REACHED | BIT_12)
    # Time of a move by v, a, d: the way is v^2/2a + v t + v^2/2d.
    both = 1 / 500.0 + 1 / 250.0
    top = top if top is not None else math.sqrt(2 * abs(way) / both)
    expected = top * both + (abs(way) - top**2 / 2 * both) / top
    fastest, time = 0.0, 0.0
    while not drive.status & TARGET_REACHED:
        drive.wait(0.002)
        time += 0.002
        fastest = max(fastest, abs(drive.read(0x606B) / COUNTS * math.tau))
        assert time < 2 * expected + 1.0
    assert time == pytest.approx(expected + 0.010, abs=0.08)
    assert fastest == pytest.approx(top, rel=0.1)
    assert position(drive) == pytest.approx(way, abs=0.06)
    drive.wait(1.0)
    assert position(drive) == pytest.approx(way, abs=2e-3)
    assert drive.read(0x6062) == counts(way)


def test_a_second_set_point_waits_and_a_third_is_not_acknowledged(drive: Drive) -> None:
    positioning(drive)
    go(drive, 10.0)
    drive.write(0x607A, 0, counts(20.0), "<i")
    drive.write(0x6040, 0, NEW, "<H")
    drive.write(0x6040, 0, 0x0F, "<H")
    assert drive.status & BIT_12, "the buffer is full"
    drive.write(0x607A, 0, counts(-99.0), "<i")
    drive.write(0x6040, 0, NEW, "<H")
    drive.write(0x6040, 0, 0x0F, "<H")
    seen = []
    for _ in range(300):
        drive.wait(0.01)
        seen.append(position(drive))
    assert not drive.status & BIT_12
    assert drive.status & TARGET_REACHED
    assert seen[-1] == pytest.approx(20.0, abs=1e-2)
    assert min(abs(angle - 10.0) for angle in seen) < 0.05
    assert max(seen) < 20.1


def test_a_set_point_that_takes_over_at_once_turns_round_on_the_way(drive: Drive) -> None:
    positioning(drive)
    go(drive, 40.0)
    drive.wait(0.3)
    go(drive, -5.0, NOW)
    drive.wait(3.0)
    assert position(drive) == pytest.approx(-5.0, abs=1e-2)


def test_relative_set_points_count_from_the_target_before(drive: Drive) -> None:
    positioning(drive)
    for _ in range(3):
        go(drive, 5.0, RELATIVE)
        drive.wait(1.5)
    assert position(drive) == pytest.approx(15.0, abs=1e-2)


def test_a_motion_goes_on_after_a_halt_and_is_forgotten_after_a_quick_stop(drive: Drive) -> None:
    positioning(drive)
    drive.write(0x605A, 0, 6, "<h")
    go(drive, 40.0)
    drive.wait(0.3)
    drive.write(0x6040, 0, 0x10F, "<H")
    drive.wait(1.0)
    assert position(drive) < 39.0
    assert abs(drive.speed) < 0.01
    drive.write(0x6040, 0, 0x0F, "<H")
    drive.wait(3.0)
    assert position(drive) == pytest.approx(40.0, abs=1e-2)
    go(drive, 0.0)
    drive.wait(0.3)
    drive.write(0x6040, 0, 0x02, "<H")
    drive.wait(1.0)
    stopped = position(drive)
    drive.write(0x6040, 0, 0x0F, "<H")
    drive.wait(1.0)
    assert position(drive) == pytest.approx(stopped, abs=1e-2)


@pytest.mark.parametrize("method", [35, 37])
def test_homing_on_the_spot_gives_the_position_its_offset(drive: Drive, method: int) -> None:
    drive.shaft.angle = 12.345
    drive.write(0x6098, 0, method, "<b")
    drive.write(0x607C, 0, 1000, "<i")
    drive.enable(Mode.HOMING)
    assert drive.status & (TARGET_REACHED | BIT_12 | BIT_13) == TARGET_REACHED, "not started"
    drive.write(0x6040, 0, 0x1F, "<H")
    assert drive.status & (TARGET_REACHED | BIT_12 | BIT_13) == TARGET_REACHED | BIT_12
    assert drive.read(0x6064) == 1000


@pytest.mark.parametrize(("method", "index"), [(33, 1), (34, 2)])
def test_homing_finds_the_index_pulse_in_its_direction(drive: Drive, method: int, index: int) -> None:
    """The encoder's zero comes once in a turn: from 1.4 turns it is at 1 going down, at 2 going up."""
    drive.shaft.angle = math.tau * 1.4
    drive.write(0x6098, 0, method, "<b")
    drive.write(0x6099, 2, COUNTS, "<I")
    drive.enable(Mode.HOMING)
    drive.write(0x6040, 0, 0x1F, "<H")
    drive.wait(0.2)
    assert drive.status & (TARGET_REACHED | BIT_12 | BIT_13) == 0, "in progress"
    drive.wait(2.0)
    assert drive.status & (TARGET_REACHED | BIT_12 | BIT_13) == TARGET_REACHED | BIT_12
    assert drive.read(0x6064) == pytest.approx((drive.shaft.angle / math.tau - index) * COUNTS, abs=2)
    assert abs(drive.speed) < 0.01


def test_homing_is_interrupted_by_bit_four(drive: Drive) -> None:
    drive.shaft.angle = math.tau * 0.5
    drive.write(0x6098, 0, 34, "<b")
    drive.write(0x6099, 2, COUNTS // 10, "<I")
    drive.enable(Mode.HOMING)
    drive.write(0x6040, 0, 0x1F, "<H")
    drive.wait(0.1)
    drive.write(0x6040, 0, 0x0F, "<H")
    drive.wait(1.0)
    assert drive.status & (TARGET_REACHED | BIT_12) == TARGET_REACHED
    assert abs(drive.speed) < 0.01


@pytest.mark.parametrize("method", [-1, 1, 17, 36])
def test_a_homing_method_that_needs_switches_is_refused(wire, method: int) -> None:
    assert wire.write(1, 0x6098, 0, struct.pack("<b", method)) == 0x06090030


def test_a_change_of_mode_in_motion_makes_no_jump(drive: Drive) -> None:
    drive.enable(Mode.PROFILE_VELOCITY)
    drive.write(0x60FF, 0, counts(50.0), "<i")
    drive.wait(2.0)
    before = drive.read(0x6074)
    drive.write(0x6060, 0, Mode.CYCLIC_VELOCITY, "<b")
    for _ in range(20):
        drive.wait(0.001)
        assert drive.read(0x6074) == pytest.approx(before, abs=3)
    assert drive.speed == pytest.approx(50.0, rel=0.01)


def test_the_dc_link_voltage_is_that_of_the_hardware(drive: Drive) -> None:
    assert drive.read(0x6079) == 282_000


TRIPS = {
    Trip.OVER_CURRENT: (0x2310, 0x03),
    Trip.OVER_VOLTAGE: (0x3210, 0x05),
    Trip.OVER_TEMPERATURE: (0x4310, 0x09),
    Trip.BLOCKED: (0x7121, 0x21),
    Trip.ENCODER: (0x7305, 0x21),
}


@pytest.mark.parametrize("trip", Trip, ids=lambda trip: trip.name)
def test_each_trip_has_its_code_in_emcy_603fh_and_1001h(drive: Drive, trip: Trip) -> None:
    code, register = TRIPS[trip]
    drive.enable(Mode.PROFILE_VELOCITY)
    drive.wire.frames()
    drive.shaft.trip(trip)
    frames = drive.wire.frames()
    assert struct.pack("<HB", code, register) in [data[:3] for can_id, data in frames if can_id == 0x081]
    drive.wait(0.05)
    assert drive.read(0x603F, signed=False) == code
    assert drive.status & 0x4F == 0x08


def test_an_encoder_that_jumps_is_noticed_and_the_power_goes_off_at_once(drive: Drive) -> None:
    drive.enable(Mode.PROFILE_VELOCITY)
    drive.write(0x60FF, 0, counts(50.0), "<i")
    drive.wait(1.0)
    drive.shaft.angle += math.tau * 0.5
    drive.wait(0.002)
    assert drive.read(0x603F, signed=False) == 0x7305
    assert not drive.shaft.enabled


def test_an_encoder_that_is_stuck_is_noticed_as_soon_as_torque_ought_to_move_it(drive: Drive, monkeypatch) -> None:
    drive.enable(Mode.PROFILE_VELOCITY)
    drive.write(0x60FF, 0, counts(20.0), "<i")
    drive.wait(1.0)
    stuck = drive.shaft.position()
    monkeypatch.setattr(drive.shaft, "position", lambda: stuck)
    monkeypatch.setattr(drive.shaft, "velocity", lambda: 0.0)
    drive.wait(0.2)
    assert drive.read(0x603F, signed=False) == 0x7305
    assert not drive.shaft.enabled


def test_a_healthy_encoder_is_never_doubted_at_the_highest_speed(drive: Drive) -> None:
    drive.enable(Mode.PROFILE_TORQUE)
    drive.write(0x6071, 0, 3000, "<h")
    drive.wait(3.0)
    assert drive.read(0x603F, signed=False) == 0


def test_a_hot_drive_warns_before_it_trips_and_refuses_a_reset_while_it_is_hot(drive: Drive) -> None:
    drive.enable(Mode.PROFILE_VELOCITY)
    drive.shaft.thermal_load = 0.95
    drive.wait(0.002)
    assert drive.status & 1 << 7
    drive.shaft.thermal_load = 1.06
    drive.shaft.trip(Trip.OVER_TEMPERATURE)
    drive.wait(0.05)
    drive.write(0x6040, 0, 0x80, "<H")
    assert drive.status & 0x4F == 0x08
    drive.shaft.thermal_load = 0.5
    drive.write(0x6040, 0, 0x00, "<H")
    drive.write(0x6040, 0, 0x80, "<H")
    assert drive.status & 0x4F == 0x40

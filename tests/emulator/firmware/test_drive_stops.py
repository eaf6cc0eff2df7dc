"""Option codes on a flywheel at speed: how long it takes to stand, by which ramp, and where the drive ends."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator

import pytest

from emulator.firmware.drive.modes import HALTING_MODES, Mode

COUNTS = 1048576
INERTIA = FRICTION = 1e-3
RATED = 1.27
SPEED = 100.0
SLOW, QUICK = 100.0, 400.0
"""6084h and 6085h [rad/s^2]."""
STANDSTILL = 0.010
"""6070h: how long the shaft must stand before it counts as standing [s]."""


def counts(angle: float) -> int:
    return round(angle / math.tau * COUNTS)


class Spinning:
    """A drive whose shaft turns at SPEED, under control in a mode."""

    def __init__(self, wire, mode: Mode) -> None:
        self.wire, self.mode = wire, mode
        self.shaft = wire.vehicle.drives[0]
        self.write(0x60F9, 3, round(INERTIA * 1e9), "<I")
        for index, value in ((0x6084, SLOW), (0x6085, QUICK), (0x6083, 1000.0), (0x60C5, 1000.0)):
            self.write(index, 0, counts(value), "<I")
        wire.nmt(0x01, 1)
        self.write(0x6060, 0, mode, "<b")
        self.control(0x06)
        self.control(0x0F)
        self.shaft.speed = SPEED
        # The torque that holds the speed against friction, or the speed itself.
        self.write(0x6071, 0, round(FRICTION * SPEED / RATED * 1000), "<h")
        self.write(0x60FF, 0, counts(SPEED), "<i")
        wire.wait(1.0)
        assert self.shaft.speed == pytest.approx(SPEED, rel=0.01)

    def write(self, index: int, subindex: int, value: int, code: str) -> None:
        assert self.wire.write(1, index, subindex, struct.pack(code, value)) == 0

    def control(self, controlword: int) -> None:
        self.write(0x6040, 0, controlword, "<H")

    @property
    def status(self) -> int:
        return self.wire.read(1, 0x6041)

    def time_until(self, condition) -> float:
        start = self.wire.devices.time
        while not condition():
            self.wire.wait(0.001)
            assert self.wire.devices.time - start < 10.0
        return self.wire.devices.time - start


@pytest.fixture(params=[Mode.PROFILE_VELOCITY, Mode.PROFILE_TORQUE, Mode.CYCLIC_VELOCITY, Mode.CYCLIC_TORQUE])
def spinning(wire, request: pytest.FixtureRequest) -> Iterator[Spinning]:
    return Spinning(wire, request.param)


TORQUE_MODES = (Mode.PROFILE_TORQUE, Mode.CYCLIC_TORQUE)


def ramp_time(kind: str, mode: Mode) -> float:
    """Time that a way of stopping takes [s], by formula."""
    if kind == "slow down" and mode in TORQUE_MODES:
        # 8 per cent of rated torque at 10 000 per mille a second.
        return round(FRICTION * SPEED / RATED * 1000) / 10_000.0
    if kind == "slow down":
        return SPEED / SLOW + STANDSTILL
    if kind == "quick stop":
        return SPEED / QUICK + STANDSTILL
    # Full torque M until the speed is within reach of the velocity loop, then its exponential approach.
    torque = 3.0 * RATED
    return INERTIA / FRICTION * math.log1p(SPEED * FRICTION / torque) + STANDSTILL


KINDS = {1: "slow down", 2: "quick stop", 3: "current limit", 4: "voltage limit"}


@pytest.mark.parametrize("option", range(9))
def test_the_quick_stop_option_chooses_ramp_and_end(spinning: Spinning, option: int) -> None:
    spinning.write(0x605A, 0, option, "<h")
    spinning.control(0x02)
    stays = option >= 5
    kind = KINDS.get(option - 4 if stays else option)
    if kind is None:
        assert spinning.status & 0x4F == 0x40
        assert not spinning.shaft.enabled
        return
    assert spinning.status & 0x6F == 0x07
    finished = (lambda: spinning.status & 1 << 10) if stays else (lambda: spinning.status & 0x4F == 0x40)
    time = spinning.time_until(finished)
    expected = ramp_time(kind, spinning.mode)
    # The limits have a tail: the last rad/s are taken by the velocity loop at its own pace.
    tail = 0.5 if "limit" in kind else 0.03
    assert expected - 0.002 <= time <= expected + tail
    assert spinning.shaft.enabled is stays
    assert spinning.status & 0x6F == (0x07 if stays else 0x40)
    if not (kind == "slow down" and spinning.mode in TORQUE_MODES):
        assert abs(spinning.shaft.speed) < 0.5


@pytest.mark.parametrize(
    ("index", "controlword", "target"), [(0x605B, 0x06, 0x21), (0x605C, 0x07, 0x23)], ids=["605Bh", "605Ch"]
)
def test_shutdown_and_disable_operation_ramp_down_first_when_told_to(
    spinning: Spinning, index: int, controlword: int, target: int
) -> None:
    spinning.write(index, 0, 1, "<h")
    spinning.control(controlword)
    assert spinning.status & 0x6F == 0x27, "the drive is still operating while it slows down"
    time = spinning.time_until(lambda: spinning.status & 0x6F == target)
    assert time == pytest.approx(ramp_time("slow down", spinning.mode), abs=0.03)
    assert not spinning.shaft.enabled


@pytest.mark.parametrize(("index", "controlword", "target"), [(0x605B, 0x06, 0x21), (0x605C, 0x07, 0x23)])
def test_shutdown_and_disable_operation_take_the_power_off_at_once_with_option_zero(
    spinning: Spinning, index: int, controlword: int, target: int
) -> None:
    spinning.write(index, 0, 0, "<h")
    spinning.control(controlword)
    assert spinning.status & 0x6F == target
    assert not spinning.shaft.enabled


def test_enable_operation_during_the_slow_down_ramp_goes_on_driving(spinning: Spinning) -> None:
    spinning.write(0x605C, 0, 1, "<h")
    spinning.write(0x6087, 0, 100, "<I")
    spinning.control(0x07)
    spinning.wire.wait(0.05)
    spinning.control(0x0F)
    spinning.wire.wait(3.0)
    assert spinning.status & 0x6F == 0x27
    assert spinning.shaft.speed == pytest.approx(SPEED, rel=0.05)


@pytest.mark.parametrize("option", range(1, 5))
def test_halt_stops_by_605dh_and_stays_in_operation_enabled(spinning: Spinning, option: int) -> None:
    spinning.write(0x605D, 0, option, "<h")
    spinning.control(0x10F)
    if spinning.mode not in HALTING_MODES:
        spinning.wire.wait(0.5)
        assert spinning.shaft.speed == pytest.approx(SPEED, rel=0.01)
        return
    time = spinning.time_until(lambda: spinning.status & 1 << 10)
    assert time >= ramp_time(KINDS[option], spinning.mode) - 0.003
    assert spinning.status & 0x6F == 0x27
    assert spinning.shaft.enabled
    spinning.control(0x0F)
    spinning.wire.wait(6.0)
    assert spinning.shaft.speed == pytest.approx(SPEED, rel=0.02)


@pytest.mark.parametrize("option", range(5))
def test_a_fault_reacts_by_605eh(spinning: Spinning, option: int) -> None:
    """A lost master with 6007h = 1 is a fault that leaves the motor usable."""
    spinning.write(0x605E, 0, option, "<h")
    spinning.write(0x1029, 1, 1, "<B")
    spinning.write(0x1016, 1, 127 << 16 | 100, "<I")
    spinning.wire.send(0x77F, b"\x05")
    spinning.wire.wait(0.1)
    if option:
        assert spinning.status & 0x4F == 0x0F
        time = spinning.time_until(lambda: spinning.status & 0x4F == 0x08)
        assert time >= ramp_time(KINDS[option], spinning.mode) - 0.003
    assert spinning.status & 0x4F == 0x08
    assert not spinning.shaft.enabled


def test_disable_voltage_lets_the_shaft_coast(spinning: Spinning) -> None:
    spinning.control(0x00)
    spinning.wire.wait(0.5)
    assert spinning.shaft.speed == pytest.approx(SPEED * math.exp(-FRICTION / INERTIA * 0.5), rel=0.01)


def test_a_quick_stop_can_be_cut_short_by_disable_voltage(spinning: Spinning) -> None:
    spinning.control(0x02)
    spinning.wire.wait(0.05)
    spinning.control(0x00)
    assert spinning.status & 0x4F == 0x40
    assert not spinning.shaft.enabled
    assert spinning.shaft.speed > 0.5 * SPEED


def test_no_set_point_moves_a_shaft_that_stops(spinning: Spinning) -> None:
    spinning.write(0x605A, 0, 6, "<h")
    spinning.control(0x02)
    spinning.write(0x6071, 0, 900, "<h")
    spinning.write(0x60FF, 0, counts(300.0), "<i")
    spinning.wire.wait(1.0)
    assert abs(spinning.shaft.speed) < 0.1


def test_an_rpdo_that_stays_away_is_a_fault_where_the_drive_moves_by_it(spinning: Spinning) -> None:
    spinning.write(0x605E, 0, 2, "<h")
    spinning.write(0x1400, 5, 50, "<H")
    spinning.wire.send(0x201, struct.pack("<Hh", 0x0F, round(FRICTION * SPEED / RATED * 1000)))
    spinning.wire.wait(0.049)
    assert spinning.status & 0x6F == 0x27
    spinning.wire.wait(0.002)
    assert spinning.wire.read(1, 0x603F) == 0x8250
    time = spinning.time_until(lambda: spinning.status & 0x4F == 0x08)
    assert time == pytest.approx(ramp_time("quick stop", spinning.mode), abs=0.03)

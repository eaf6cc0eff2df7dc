"""Faults that nobody injects: they follow from what the vehicle is made to do."""

from __future__ import annotations

import math
from collections.abc import Iterator

import pytest

from emulator.prototype import load_prototype
from emulator.vehicle import EmulatedVehicle
from hil.bench.lockstep import LockstepBench
from hil.master import Master
from hil.master.errors import DriveStateError
from hil.network import load_network

COUNTS = 1048576
FORWARD = (1, 1, -1, -1)
PROFILE_VELOCITY, CYCLIC_POSITION, CYCLIC_VELOCITY = 3, 8, 9


class Vehicle:
    """The prototype on its bench, with a master that goes on exchanging cycles."""

    def __init__(self, vehicle: EmulatedVehicle, bench: LockstepBench) -> None:
        self.emulated, self.bench = vehicle, bench
        self.network = load_network()
        self.master = Master(bench.bus, bench.clock, self.network)
        self.master.boot()

    def write(self, index: int, values: tuple[int, int, int, int]) -> None:
        for node, value in zip(self.network.drives, values, strict=True):
            self.master.object_access(node).write(index, 0, value)

    def read(self, index: int) -> list[int]:
        return [self.master.object_access(node).read(index) for node in self.network.drives]

    def enable(self, mode: int) -> None:
        self.write(0x6060, (mode,) * 4)
        self.master.enable()

    def run(self, duration: float) -> None:
        for _ in range(round(duration / self.network.cycle_period)):
            self.master.exchange((0.0,) * 4)

    def time_until_fault(self, limit: float) -> float:
        start = self.bench.clock.now()
        with pytest.raises(DriveStateError):
            self.run(limit)
        return self.bench.clock.now() - start

    def jam(self, wheel: int) -> None:
        """Something is caught in a wheel: it does not turn any more, whatever its drive does."""
        engine = self.emulated.engine
        friction = list(engine.coulomb)
        friction[4 + wheel] = 1e4
        engine.set_friction(friction)


@pytest.fixture
def vehicle() -> Iterator[Vehicle]:
    with EmulatedVehicle(load_prototype(), seed=1) as emulated, LockstepBench(emulated) as bench:
        yield Vehicle(emulated, bench)


def forward(value: float) -> tuple[int, int, int, int]:
    fl, rl, fr, rr = (round(sign * value) for sign in FORWARD)
    return fl, rl, fr, rr


@pytest.mark.parametrize(
    ("torque_limit", "code", "after"), [(3000, 0x2310, 1.0), (1500, 0x7121, 2.0)], ids=["over-current", "blocked"]
)
def test_a_jammed_wheel_trips_its_own_drive(vehicle: Vehicle, torque_limit: int, code: int, after: float) -> None:
    vehicle.jam(1)
    vehicle.write(0x6072, (3000, torque_limit, 3000, 3000))
    vehicle.enable(PROFILE_VELOCITY)
    vehicle.master.object_access(vehicle.network.drives[1]).write(0x60FF, 0, 10 * COUNTS)
    time = vehicle.time_until_fault(4.0)
    assert vehicle.read(0x603F) == [0, code, 0, 0]
    assert after < time < after + 1.0, "the velocity loop takes a while to wind up to its limit"


def test_braking_harder_than_the_chopper_can_take_trips_on_over_voltage(vehicle: Vehicle) -> None:
    vehicle.enable(CYCLIC_VELOCITY)
    top = 1.5 / 0.1 * 20
    for step in range(100):
        vehicle.write(0x60FF, forward(top * (step + 1) / 100 / math.tau * COUNTS))
        vehicle.run(0.02)
    supply, running = 282_000, vehicle.read(0x6079)
    assert all(abs(voltage - supply) < 1000 for voltage in running)
    vehicle.write(0x60FF, (0,) * 4)
    vehicle.time_until_fault(1.0)
    assert set(vehicle.read(0x603F)) == {0x3210}
    assert all(voltage > 400_000 for voltage in vehicle.read(0x6079)), "the charge stays"
    assert vehicle.emulated.ground_truth().twist[0] > 0.5, "without power the vehicle coasts"


def test_a_step_that_842_kg_cannot_follow_is_a_following_error(vehicle: Vehicle) -> None:
    vehicle.enable(CYCLIC_POSITION)
    start = vehicle.read(0x6064)
    fl, rl, fr, rr = (s + f for s, f in zip(start, forward(20 * COUNTS), strict=True))
    vehicle.write(0x607A, (fl, rl, fr, rr))
    time = vehicle.time_until_fault(2.0)
    assert 0x8611 in vehicle.read(0x603F)
    assert time > 0.1, "6066h"


@pytest.mark.slow
def test_accelerating_to_and_fro_for_too_long_overheats_the_motors_and_they_warn_before(vehicle: Vehicle) -> None:
    """Two times rated torque without a pause: h' = (4 - h) / tau reaches 1.05 after tau ln(4 / 2.95)."""
    vehicle.write(0x6072, (2000,) * 4)
    vehicle.enable(PROFILE_VELOCITY)
    for index in (0x6083, 0x6084):
        vehicle.write(index, (8 * 33_000_000,) * 4)
    start = vehicle.bench.clock.now()
    warned = to_and_fro_until_fault(vehicle)
    end = vehicle.bench.clock.now()
    assert 0x4310 in vehicle.read(0x603F)
    time_constant = -3.0 / math.log(1 - 1.05 / (3.8 / 1.27) ** 2)
    assert end - start == pytest.approx(time_constant * math.log(4 / 2.95), rel=0.15)
    assert start < warned < end


def to_and_fro_until_fault(vehicle: Vehicle) -> float:
    """Instant of the first warning."""
    warned = math.inf
    for k in range(100):
        vehicle.write(0x60FF, forward((-1) ** k * 25 * COUNTS))
        try:
            vehicle.run(0.4)
        except DriveStateError:
            return warned
        if any(word & 1 << 7 for word in vehicle.read(0x6041)):
            warned = min(warned, vehicle.bench.clock.now())
    raise AssertionError("no drive has overheated")

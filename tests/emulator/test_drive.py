"""A drive delivers the torque it is told to, as fast as its current loop, up to its peak, when enabled."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from emulator.drive import Drive
from emulator.power_stage import Trip
from emulator.prototype import load_prototype
from emulator.vehicle import EmulatedVehicle


@pytest.fixture
def stand() -> Iterator[EmulatedVehicle]:
    with EmulatedVehicle(load_prototype(), seed=3, noise_scale=0.0) as vehicle:
        vehicle.lift()
        yield vehicle


def enabled(vehicle: EmulatedVehicle) -> tuple[Drive, Drive, Drive, Drive]:
    for drive in vehicle.drives:
        drive.enable()
    return vehicle.drives


def test_the_data_sheet_is_a_400_w_servo(stand: EmulatedVehicle) -> None:
    drive = stand.drives[0]
    assert drive.rated_torque * 3000 * math.tau / 60 == pytest.approx(400, rel=0.005)
    assert drive.peak_torque == pytest.approx(3 * drive.rated_torque, rel=0.01)


def test_a_disabled_drive_gives_no_torque(stand: EmulatedVehicle) -> None:
    drive = stand.drives[0]
    drive.command(1.0)
    stand.advance(0.01)
    assert not drive.enabled
    assert drive.measured_torque() == 0.0


def test_disabling_takes_the_torque_away_at_once_and_forgets_the_set_point(stand: EmulatedVehicle) -> None:
    drive = enabled(stand)[1]
    drive.command(1.0)
    stand.advance(0.01)
    assert drive.measured_torque() == pytest.approx(1.0)
    drive.disable()
    assert drive.measured_torque() == 0.0
    drive.enable()
    stand.advance(0.01)
    assert drive.measured_torque() == 0.0


@pytest.mark.parametrize(("powered", "told"), [(False, 3), (True, 1)], ids=["without power", "with power"])
def test_a_trip_is_told_whatever_the_power_does_and_with_power_once(
    stand: EmulatedVehicle, powered: bool, told: int
) -> None:
    drive = (enabled(stand) if powered else stand.drives)[0]
    trips: list[Trip] = []
    drive.watch(trips.append)
    for _ in range(3):
        drive.trip(Trip.ENCODER)
    assert trips == [Trip.ENCODER] * told
    drive.disable()
    drive.trip(Trip.BLOCKED)
    assert trips[-1] is Trip.BLOCKED


@settings(max_examples=20, deadline=None)
@given(st.floats(-100, 100))
def test_torque_settles_at_the_command_limited_to_the_peak(torque: float) -> None:
    with EmulatedVehicle(load_prototype(), seed=3, noise_scale=0.0) as vehicle:
        drive = enabled(vehicle)[2]
        drive.command(torque)
        vehicle.advance(0.01)
        assert drive.measured_torque() == pytest.approx(math.copysign(min(abs(torque), 3.8), torque), abs=1e-12)


def test_torque_follows_the_interpolated_set_point_through_the_current_loop(stand: EmulatedVehicle) -> None:
    """Against a numerical solution of T' = w (s(t) - T), set-points every 2 ms reached linearly in 2 ms."""
    drive = enabled(stand)[0]
    bandwidth, cycle = load_prototype().drive.current_loop_bandwidth, 2e-3
    commands = [1.0, -0.4, 0.7, 0.7, -1.2]
    knots = np.array([0.0, *commands])
    times, actual = [], []
    for command in commands:
        drive.command(command)
        for _ in range(2):
            stand.advance(1e-3)
            times.append(stand.time)
            actual.append(drive.measured_torque())

    def rate(time: float, torque: np.ndarray) -> np.ndarray:
        return bandwidth * (np.interp(time, np.arange(len(knots)) * cycle, knots) - torque)

    solution = solve_ivp(rate, (0, times[-1]), [0.0], t_eval=times, rtol=1e-9, atol=1e-9, max_step=1e-5)
    assert actual == pytest.approx(solution.y[0], abs=1e-6)


def test_the_sign_of_a_drive_is_that_of_its_mounting() -> None:
    """Positive torque turns every shaft positive; whether the wheel rolls forward is the mounting's matter."""
    for name in ("prototype", "compact"):
        prototype = load_prototype(name)
        with EmulatedVehicle(prototype, seed=0, noise_scale=0.0) as vehicle:
            vehicle.lift()
            before = [drive.position() for drive in vehicle.drives]
            for drive in enabled(vehicle):
                drive.command(1.0)
            vehicle.advance(0.05)
            assert all(drive.velocity() > 0 for drive in vehicle.drives)
            assert all(d.position() > b for d, b in zip(vehicle.drives, before, strict=True))
            forward = np.sign(vehicle.ground_truth().wheel_rates)
            assert tuple(forward) == prototype.drive.directions


def test_sensor_noise_is_white_and_as_large_as_stated() -> None:
    with EmulatedVehicle(load_prototype(), seed=7) as vehicle:
        readings = np.array([measure(vehicle) for _ in range(4000)])
    assert readings.std(axis=0) == pytest.approx([0.005 * 1.27] * 4, rel=0.06)
    correlation = np.corrcoef(np.hstack([readings[1:], readings[:-1]]).T)
    assert np.abs(correlation - np.eye(8)).max() < 0.07


def measure(vehicle: EmulatedVehicle) -> list[float]:
    vehicle.advance(1e-3)
    return [drive.measured_torque() for drive in vehicle.drives]


def test_reading_twice_at_one_time_gives_one_value() -> None:
    with EmulatedVehicle(load_prototype(), seed=7) as vehicle:
        vehicle.advance(0.01)
        first = [(d.measured_torque(), d.position()) for d in vehicle.drives]
        assert first == [(d.measured_torque(), d.position()) for d in vehicle.drives]

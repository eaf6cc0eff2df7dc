"""DC link by its energy balance, protection by its times."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from emulator.power_stage import PowerStage, PowerStageData, Trip

STEP = 1e-3
DATA = PowerStageData(
    supply_voltage=300.0,
    link_capacitance=1e-3,
    chopper_voltage=380.0,
    chopper_power=200.0,
    over_voltage=400.0,
    phase_resistance=1.0,
    peak_time=1.0,
    overload_time=3.0,
    stall_time=2.0,
)
RATED, PEAK, CURRENT = 1.0, 3.0, 2.0
COPPER = 3 * DATA.phase_resistance * (CURRENT / RATED) ** 2
"""Loss at a torque of 1 Nm [W]."""


def stage() -> PowerStage:
    return PowerStage(DATA, RATED, PEAK, CURRENT, STEP)


def run(power_stage: PowerStage, torque: float, speed: float, duration: float) -> tuple[float, Trip | None]:
    """Time until a trip, or the whole duration, and the trip."""
    for step in range(round(duration / STEP)):
        trip = power_stage.advance(torque, speed)
        if trip is not None:
            return (step + 1) * STEP, trip
    return duration, None


@given(torque=st.floats(-0.99, 0.99), speed=st.floats(-100.0, 100.0), steps=st.integers(1, 200))
def test_the_link_stores_what_the_motor_gives_back_less_copper_losses(torque: float, speed: float, steps: int) -> None:
    power_stage = stage()
    for _ in range(steps):
        assert power_stage.advance(torque, speed) is None
    given_back = max(-(torque * speed + COPPER * torque**2), 0.0) * steps * STEP
    energy = 0.5 * DATA.link_capacitance * DATA.supply_voltage**2 + given_back
    # At most 20 J come back, and the chopper starts at 27 J.
    assert power_stage.voltage == pytest.approx(math.sqrt(2 * energy / DATA.link_capacitance))


def test_braking_within_the_power_of_the_chopper_settles_at_its_threshold() -> None:
    power_stage = stage()
    assert run(power_stage, -0.9, 150.0, 5.0) == (5.0, None)
    assert power_stage.voltage == pytest.approx(380.0, abs=0.5)


def test_braking_beyond_the_chopper_trips_when_the_capacitor_is_full() -> None:
    """From 300 V to 400 V at P, of which the chopper takes 200 W above 380 V."""
    torque, speed = -0.9, 500.0
    power = -torque * speed - COPPER * torque**2
    charge = 0.5 * DATA.link_capacitance
    expected = charge * (380.0**2 - 300.0**2) / power + charge * (400.0**2 - 380.0**2) / (power - 200.0)
    time, trip = run(stage(), torque, speed, 5.0)
    assert trip is Trip.OVER_VOLTAGE
    assert time == pytest.approx(expected, abs=2 * STEP)


def test_driving_never_draws_the_link_below_its_supply() -> None:
    power_stage = stage()
    run(power_stage, 0.9, 300.0, 1.0)
    assert power_stage.voltage == pytest.approx(300.0)


def test_peak_current_is_carried_for_its_time() -> None:
    time, trip = run(stage(), 3.0, 50.0, 5.0)
    assert (trip, time) == (Trip.OVER_CURRENT, pytest.approx(DATA.peak_time, abs=2 * STEP))


def test_a_blocked_shaft_under_more_than_rated_torque_is_noticed_after_its_time() -> None:
    time, trip = run(stage(), 1.5, 0.2, 5.0)
    assert (trip, time) == (Trip.BLOCKED, pytest.approx(DATA.stall_time, abs=2 * STEP))


def test_rated_torque_may_hold_a_blocked_shaft_for_ever() -> None:
    assert run(stage(), 1.0, 0.0, 100.0)[1] is None


@pytest.mark.parametrize("overload", [1.5, 2.0, 2.5])
def test_overload_trips_by_the_square_of_the_current(overload: float) -> None:
    """tau h' = i^2 - h, trip at 1.05, and tau such that peak current of 3 trips after 3 s."""
    time_constant = -3.0 / math.log(1 - 1.05 / 9)
    expected = -time_constant * math.log(1 - 1.05 / overload**2)
    time, trip = run(stage(), overload, 50.0, 60.0)
    assert (trip, time) == (Trip.OVER_TEMPERATURE, pytest.approx(expected, rel=1e-3))


def test_a_motor_cools_down_without_current() -> None:
    power_stage = stage()
    run(power_stage, 2.0, 50.0, 3.0)
    before = power_stage.thermal_load
    for _ in range(10_000):
        power_stage.rest()
    time_constant = -3.0 / math.log(1 - 1.05 / 9)
    assert power_stage.thermal_load == pytest.approx(before * math.exp(-10.0 / time_constant), rel=1e-6)


def test_a_trip_is_reported_once_until_it_is_cleared() -> None:
    power_stage, seen = stage(), []
    power_stage.watch(seen.append)
    power_stage.report(Trip.ENCODER)
    power_stage.report(Trip.OVER_CURRENT)
    power_stage.clear()
    power_stage.report(Trip.BLOCKED)
    assert seen == [Trip.ENCODER, Trip.BLOCKED]


def test_a_drive_that_brakes_because_it_is_hot_is_still_protected() -> None:
    power_stage, seen = stage(), []
    power_stage.watch(seen.append)
    _, trip = run(power_stage, 2.0, 100.0, 30.0)
    assert trip is Trip.OVER_TEMPERATURE
    power_stage.report(trip)
    for _ in range(100):
        trip = power_stage.advance(-2.0, 1000.0)
        if trip is not None:
            power_stage.report(trip)
    assert power_stage.thermal_load > 1.05
    assert seen == [Trip.OVER_TEMPERATURE, Trip.OVER_VOLTAGE]

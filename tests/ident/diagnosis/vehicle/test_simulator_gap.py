"""Windows of a record, and by how much a simulator is off in them: statements about numbers put in by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from ident.diagnosis.vehicle.shooting import Windows, differences_of, shoot, windows_of
from ident.diagnosis.vehicle.simulator_gap import simulator_gap
from ident.errors import RecordError
from ident.estimate.filters import Processing
from ident.records.record import Record, Segment, make_segment
from ident.vehicle.description import load_vehicle

GEOMETRY = load_vehicle().geometry
PROCESSING = Processing()
DT, PERIODS, PERIOD = 0.002, 4, 1500
SPEED_NOISE = 0.01


def segment(step: str, *, periods: int = PERIODS) -> Segment:
    """Wheels and a steering side that swing, three seconds a repeat, and 0.2 s before the first."""
    lead = 100
    samples = lead + max(periods, 1) * PERIOD
    time = np.arange(samples) * DT
    swing = np.sin(2 * np.pi * (time - lead * DT) / (PERIOD * DT))
    wheels = np.outer(swing, np.ones(4)) if step != "steering_left" else np.outer(swing, [-1.0, 1.0, 0.0, 0.0])
    steering = np.outer(swing, [1.0, 0.0]) if step == "steering_left" else np.zeros((samples, 2))
    period = np.full(samples, -1)
    for number in range(periods):
        period[lead + number * PERIOD : lead + (number + 1) * PERIOD] = number
    torques = np.zeros((samples, 4))
    return make_segment(Segment(step, DT, time, torques, 5 * wheels, 0.4 * steering, period), "test")


def measured(windows: Windows) -> np.ndarray:
    own = windows.segment
    return np.hstack([own.steering_angles, own.wheel_angles])[windows.samples]


def faster(speed: float, noise: float = 0.0) -> object:
    """A simulator whose wheels turn faster by so much [rad/s], and whose repeats differ."""

    def simulate(windows: Windows) -> np.ndarray:
        time = np.arange(windows.length) * DT
        scatter = np.where(windows.repeat % 2 == 0, 1.0, -1.0) * noise
        off = (speed + scatter)[:, None] * time
        read = measured(windows)
        read[..., 2:] += off[..., None]
        return read

    return simulate


def windows(*steps: str, periods: int = PERIODS) -> list[Windows]:
    return windows_of(Record([segment(step, periods=periods) for step in steps]), GEOMETRY, PROCESSING)


def test_windows_divide_every_repeat_at_the_same_places() -> None:
    (own,) = windows("straight")
    assert own.length * DT == pytest.approx(1.0)
    assert own.repeat.tolist() == [number for number in range(PERIODS) for _ in range(3)]
    assert own.place.tolist() == [0, 1, 2] * PERIODS
    assert (own.segment.period[own.samples] == own.repeat[:, None]).all()


def test_a_step_that_does_not_repeat_is_covered_as_well() -> None:
    (own,) = windows("lane_change", periods=0)
    assert own.starts[0] == 0
    assert len(own.starts) * own.length > 0.95 * len(own.segment)
    assert set(own.repeat.tolist()) == {-1}


def test_a_repeat_with_a_cycle_left_out_is_not_simulated() -> None:
    whole = segment("straight")
    broken = whole.period.copy()
    broken[100 + PERIOD + 700] = -1
    (own,) = windows_of(Record([replace(whole, period=broken)]), GEOMETRY, PROCESSING)
    assert set(own.repeat.tolist()) == {0, 2, 3}


def test_a_record_without_a_step_to_simulate_is_refused() -> None:
    with pytest.raises(RecordError, match="no step to simulate"):
        windows("parade")


def test_a_simulator_that_reads_what_was_recorded_is_off_by_nothing() -> None:
    for difference in shoot(windows("straight", "steering_left"), measured, GEOMETRY, PROCESSING):
        assert np.abs(difference.simulated - difference.recorded).max() < 1e-12


def test_a_wheel_speed_too_high_is_a_travel_speed_too_high_by_the_radius() -> None:
    (own,) = windows("straight")
    (off,) = differences_of(own, faster(0.1)(own), GEOMETRY, PROCESSING)
    middle = (off.simulated - off.recorded)[:, 100:-100]
    assert off.coordinate == "x"
    assert middle == pytest.approx(0.1 * GEOMETRY.wheel_radius, rel=5e-3)


def test_a_steering_angle_is_compared_as_an_angle() -> None:
    (own,) = windows("steering_left")
    read = measured(own)
    read[..., 0] += 0.02
    (off,) = differences_of(own, read, GEOMETRY, PROCESSING)
    assert (off.unit, off.coordinate) == ("rad", "alpha_l")
    assert off.simulated - off.recorded == pytest.approx(0.02, rel=1e-6)


def test_what_is_left_is_counted_above_the_noise_between_repeats() -> None:
    """Before: speed off by e with scatter n; after: by e/10. The floor is n with one degree of freedom taken off."""
    own = windows("straight")
    before, after = (shoot(own, faster(speed, SPEED_NOISE), GEOMETRY, PROCESSING) for speed in (0.1, 0.01))
    gap = simulator_gap(before, after)
    (one,) = gap.steps
    floor = SPEED_NOISE * math.sqrt(PERIODS / (PERIODS - 1))
    assert one.gap.floor == pytest.approx(floor * GEOMETRY.wheel_radius, rel=0.02)
    assert one.in_noise.before == pytest.approx(math.hypot(0.1, SPEED_NOISE) / floor, rel=0.02)
    assert one.closed == pytest.approx(
        1 - (0.01**2 + SPEED_NOISE**2 - floor**2) / (0.1**2 + SPEED_NOISE**2 - floor**2), abs=0.01
    )
    assert gap.total.closed == pytest.approx(one.closed)
    assert one.share == 1.0


def test_the_noise_of_one_step_is_not_taken_for_that_of_another() -> None:
    own = [*windows("straight"), *windows("lane_change", periods=0)]
    before, after = (shoot(own, faster(speed, SPEED_NOISE), GEOMETRY, PROCESSING) for speed in (0.1, 0.02))
    gap = simulator_gap(before, after)
    free = [one for one in gap.steps if one.step == "lane_change" and one.coordinate == "x"]
    assert [one.repeats for one in free] == [False]
    assert math.isnan(free[0].gap.floor)
    assert 0.9 < free[0].closed < 1.0
    assert gap.total.before == pytest.approx(gap.steps[0].in_noise.before)

"""What a simulator is held by, and how the torque that it lacks is counted: statements about numbers put in by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.diagnosis.vehicle.records.following import Difference, Following, all_differences, followings_of
from ident.diagnosis.vehicle.simulator_gap import simulator_gap
from ident.errors import RecordError
from ident.estimate.equations import equations_of
from ident.estimate.filters import Processing
from ident.records.record import Record, Segment, make_segment
from ident.vehicle.description import load_vehicle

VEHICLE = load_vehicle()
GEOMETRY = VEHICLE.geometry
PROCESSING = Processing()
DT, PERIODS, PERIOD = 0.002, 4, 1500
NOISE = 0.5

SIDES = {"steering_left": (1.0, 0.0), "steering_right": (0.0, 1.0)}
POSTURES = {"rotation": (-1.0, 1.0), "lateral": (math.pi / 2, -math.pi / 2)}


def segment(step: str, *, periods: int = PERIODS) -> Segment:
    """Joints that swing, three seconds a repeat, and 0.2 s before the first; torques of their own."""
    lead = 100
    samples = lead + max(periods, 1) * PERIOD
    time = np.arange(samples) * DT
    swing = np.sin(2 * np.pi * (time - lead * DT) / (PERIOD * DT))
    wheels = {"steering_left": [-1.0, 1, 0, 0], "steering_right": [0.0, 0, 1, -1], "rotation": [-1.0, -1, 1, 1]}
    steering = np.outer(0.4 * swing, SIDES.get(step, (0.0, 0.0)))
    if step == "rotation":
        steering = steering + GEOMETRY.rotation_angle * np.array(POSTURES[step])
    period = np.full(samples, -1)
    for number in range(periods):
        period[lead + number * PERIOD : lead + (number + 1) * PERIOD] = number
    torques = np.outer(np.cos(7 * time), [0.3, -0.1, 0.2, 0.4])
    angles = np.outer(5 * swing, wheels.get(step, [1.0] * 4))
    return make_segment(Segment(step, DT, time, torques, angles, steering, period), "test")


def following(step: str, **options: int) -> Following:
    (own,) = followings_of(Record([segment(step, **options)]), GEOMETRY, VEHICLE.prior, PROCESSING)
    return own


def forces(own: Following, size: float, noise: float = NOISE) -> NDArray[np.float64]:
    """A constant, and a noise that changes its sign from repeat to repeat."""
    sign = np.where(own.segment.period % 2 == 0, 1.0, -1.0)
    return np.repeat((size + noise * sign)[:, None], len(own.coordinates), axis=1)


@pytest.mark.parametrize("step", ["steering_left", "steering_right", "straight", "rotation", "wheel_lifted"])
def test_the_recorded_torque_is_that_of_the_estimate(step: str) -> None:
    """The same projection as in (22), written for the estimate on its own; in rows that move, it leaves out others."""
    own = following(step)
    for column, equations in enumerate(equations_of(own.segment, GEOMETRY, PROCESSING)):
        assert own.coordinates[column] == equations.coordinate
        rows = equations.moving & own.moving[:, column]
        error = own.recorded[rows, column] - equations.torque[rows]
        assert np.sqrt(np.mean(error**2)) < 0.01 * np.sqrt(np.mean(equations.torque[rows] ** 2))
        assert (own.moving[:, column] == equations.moving).mean() > 0.99


def test_travel_is_held_at_all_wheels_and_steering_at_its_own_side() -> None:
    straight, right = following("straight"), following("steering_right")
    assert straight.weights[0, 0, 2:] == pytest.approx([1 / GEOMETRY.wheel_radius] * 4)
    assert straight.weights[0, 0, :2].tolist() == [0.0, 0.0]
    assert right.weights[0, 0].tolist() == [0.0, 1.0, 0.0, 0.0, 0.0, 0.0]


def test_wheels_in_the_air_are_held_one_by_one() -> None:
    own = following("wheel_lifted")
    assert own.lifted
    assert own.weights[0].tolist() == np.hstack([np.zeros((4, 2)), np.eye(4)]).tolist()


def test_a_lane_change_is_held_at_both_sides_and_along() -> None:
    assert following("lane_change", periods=0).coordinates == ("alpha_l", "alpha_r", "x")


def test_a_record_without_a_step_to_simulate_is_refused() -> None:
    with pytest.raises(RecordError, match="no step to simulate"):
        following("parade")


def test_only_rows_that_move_in_every_repeat_are_compared() -> None:
    own = following("straight")
    (difference,) = all_differences([own], [forces(own, 3.0)], PROCESSING)
    assert difference.off.shape[0] == PERIODS
    assert 0.5 * PERIOD < difference.off.shape[1] < PERIOD
    # It stands still twice in a repeat: the stretches between.
    assert len(np.unique(difference.runs)) >= 2


def test_what_is_left_is_counted_above_the_noise_between_repeats() -> None:
    """Before e, after e/10, each with a noise n of alternating sign: its variance with one degree of freedom off."""
    own = following("straight")
    before, after = (all_differences([own], [forces(own, size)], PROCESSING) for size in (5.0, 0.5))
    gap = simulator_gap(before, after)
    (one,) = gap.steps
    floor = NOISE * math.sqrt(PERIODS / (PERIODS - 1))
    assert one.unit == "N"
    assert one.gap.floor == pytest.approx(floor, rel=0.05)
    assert one.gap.before == pytest.approx(math.hypot(5.0, NOISE), rel=0.01)
    assert one.gap.after == pytest.approx(math.hypot(0.5, NOISE), rel=0.05)
    assert one.closed == pytest.approx(1 - (one.gap.after**2 - floor**2) / (one.gap.before**2 - floor**2), abs=0.01)
    assert gap.total.closed == pytest.approx(one.closed)
    assert one.share == 1.0


def test_the_noise_of_one_step_is_not_taken_for_that_of_another() -> None:
    owns = [following("straight"), following("lane_change", periods=0)]
    before, after = (all_differences(owns, [forces(own, size) for own in owns], PROCESSING) for size in (5.0, 1.0))
    gap = simulator_gap(before, after)
    free = [one for one in gap.steps if one.step == "lane_change"]
    assert free
    assert [one.repeats for one in free] == [False] * len(free)
    assert all(math.isnan(one.gap.floor) and 0.9 < one.closed < 1.0 for one in free)
    assert gap.total.before == pytest.approx(gap.steps[0].in_noise.before)


def test_a_gap_that_is_all_noise_has_nothing_to_close() -> None:
    own = following("straight")
    same: list[Difference] = all_differences([own], [forces(own, 0.0)], PROCESSING)
    gap = simulator_gap(same, same)
    assert gap.steps[0].share == 0.0
    assert gap.total.before <= 1.0

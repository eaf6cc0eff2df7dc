"""A rear unit that wanders in the play of its coupling while its side steers tells that play."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import ndimage

from ident.diagnosis.problem import Channel, Problem
from ident.diagnosis.vehicle.build import build_problem
from ident.diagnosis.vehicle.experiment.ideal import Drive, ideal_record
from ident.diagnosis.vehicle.records.sources import Source, processing_of, sources_of
from ident.diagnosis.vehicle.records.wandering import LEAST, WINDOW, Wandering, wandering, wanders
from ident.errors import RecordError
from ident.records.record import Record, Segment, Step
from ident.vehicle.description import VehicleDescription

Array = NDArray[np.float64]

DT = 0.002
GAP = 3e-4
TIME = np.arange(round(12.0 / DT)) * DT
STEERED = 0.3 * np.sin(2.0 * TIME)


def flank(time: Array, seed: int = 1) -> Array:
    """+1 or -1 (N,), changing within 60 ms at random moments, at least twice a second."""
    moments = np.cumsum(np.random.default_rng(seed).uniform(0.1, 0.4, size=round(20 * time[-1]) + 20))
    hops = 1.0 - 2.0 * (np.searchsorted(moments, time - time[0]) % 2)
    return np.asarray(ndimage.uniform_filter1d(hops, round(0.06 / (time[1] - time[0]))))


DRIVEN = np.stack([8.0 * np.sign(np.cos(2.0 * TIME)) + np.cos(2.0 * TIME)] * 2, axis=1) * [1.0, -1.0]
"""Torques that steer it against dry friction."""
EVERYWHERE = np.ones(len(TIME), dtype=bool)


def ranging(apart: Array, near: NDArray[np.bool_] = EVERYWHERE, moving: NDArray[np.bool_] = EVERYWHERE) -> Wandering:
    """`wandering` of a rear unit that is `apart` (N,) [rad] from the front one."""
    found = wandering(STEERED, np.stack([STEERED, STEERED + apart], axis=1), DRIVEN, near, moving, DT)
    assert found is not None
    return found


@settings(max_examples=20, deadline=None)
@given(gap=st.floats(1e-4, 5e-3), seed=st.integers(0, 1000))
def test_a_unit_that_hops_from_flank_to_flank_ranges_over_its_play(gap: float, seed: int) -> None:
    found = ranging(gap / 2 * flank(TIME, seed))
    assert found.across == pytest.approx(gap, rel=0.1)
    assert not found.foretold


@pytest.mark.parametrize("phase", [0.0, 1.0, 2.0])
def test_wheels_that_are_larger_or_eccentric_do_not_wander(phase: float) -> None:
    assert ranging(1e-3 * STEERED + 2e-3 / 1.2 * np.cos(1.2 * STEERED + phase)).across < LEAST / 2


@pytest.mark.parametrize("wheel", [0, 1])
def test_a_gear_that_gives_way_under_its_load_is_no_play_of_the_coupling(wheel: int) -> None:
    torque = DRIVEN[:, wheel]
    for apart in (1e-4 * torque, 4e-4 * np.tanh(3 * torque)):
        found = ranging(apart)
        assert found.across > LEAST
        assert found.foretold


def test_a_wheel_that_is_eccentric_and_not_quite_a_function_of_the_angle_is_no_play() -> None:
    found = ranging(2e-3 * np.cos(1.2 * STEERED + 1.0) + 5e-5 * flank(TIME))
    assert found.across > LEAST
    assert found.foretold


def test_nothing_is_said_without_a_whole_window() -> None:
    turned = np.stack([STEERED, STEERED + GAP / 2 * flank(TIME)], axis=1)
    for width, said in ((0.9 * WINDOW, False), (1.1 * WINDOW, True)):
        near = (TIME > 2) & (2 + width > TIME)
        assert (wandering(STEERED, turned, DRIVEN, near, EVERYWHERE, DT) is not None) == said


def test_what_happens_far_from_the_middle_is_not_looked_at() -> None:
    near = TIME > 3
    pushed = 5e-3 * np.sin(7 * TIME) * ~near
    assert ranging(pushed, near).across < LEAST / 2


def test_time_in_which_nothing_steers_does_not_count() -> None:
    moving = (TIME > 2) & (TIME < 3)
    assert ranging(GAP / 2 * flank(TIME) * moving, moving=moving).across == pytest.approx(GAP, rel=0.1)
    assert wandering(STEERED, np.zeros((len(TIME), 2)), DRIVEN, EVERYWHERE, ~EVERYWHERE, DT) is None


def test_a_unit_that_mostly_stays_on_one_flank_tells_its_play_all_the_same() -> None:
    found = ranging(GAP / 2 * np.where(np.abs(TIME - 8.0) < 0.1, 1.0, -1.0), TIME > 3)
    assert found.across == pytest.approx(GAP, rel=0.1)
    assert not found.foretold


def test_what_both_sides_show_is_the_floor() -> None:
    much, little = 3 * LEAST, 0.3 * LEAST
    assert wanders(much, [little])
    assert not wanders(much, [much])
    assert not wanders(little, [0.1 * little])
    assert not wanders(much, [])


def hopping(segment: Segment, wheels: list[int], prototype: VehicleDescription, gap: float = GAP) -> Segment:
    """Some wheels of a side rolled by a unit that hops in a play."""
    angles = segment.wheel_angles.copy()
    for wheel in wheels:
        sense = (-1.0, 1.0, 1.0, -1.0)[wheel] * prototype.geometry.lever_ratio
        angles[:, wheel] += sense * gap / 2 * flank(segment.time, wheel // 2)
    return replace(segment, wheel_angles=angles)


def steered_slowly(segment: Segment, side: int, prototype: VehicleDescription) -> Segment:
    """A side that steers within 0.3 rad, its wheels rolling with it."""
    alpha, angles = np.zeros((len(segment), 2)), np.zeros((len(segment), 4))
    alpha[:, side] = 0.3 * np.sin(2.0 * (segment.time - segment.time[0]))
    angles[:, 2 * side : 2 * side + 2] = (-1) ** side * prototype.geometry.lever_ratio * alpha[:, [side]] * [-1, 1]
    return replace(segment, steering_angles=alpha, wheel_angles=angles)


@pytest.fixture(scope="module")
def still(prototype: VehicleDescription) -> Record:
    record = ideal_record([Drive(Step.STEERING_LEFT), Drive(Step.STEERING_RIGHT)], prototype)
    return replace(record, segments=[steered_slowly(one, side, prototype) for side, one in enumerate(record.segments)])


def wandering_units(record: Record, prototype: VehicleDescription) -> list[Source]:
    found = sources_of(record, prototype.geometry, list(Step), processing_of([record]))
    return [source for source in found if source.own is not None]


def play(record: Record, prototype: VehicleDescription) -> tuple[Problem, int]:
    """The problem, and the number of the block of the unit that wanders."""
    problem = build_problem([record], prototype)
    return problem, [block.coordinate for block in problem.blocks].index("wander_l")


def test_a_plain_vehicle_has_no_rows_of_units_that_wander(still: Record, prototype: VehicleDescription) -> None:
    assert wandering_units(still, prototype) == []


@pytest.mark.parametrize("side", [0, 1])
def test_a_motor_that_is_pushed_while_its_wheel_rests_hides_no_unit(
    side: int, still: Record, prototype: VehicleDescription
) -> None:
    segments = [hopping(still.segments[0], [1], prototype), still.segments[1]]
    angles = segments[side].wheel_angles.copy()
    angles[:, 2 - 2 * side] += 3e-4 * np.sin(5 * segments[side].time)
    segments[side] = replace(segments[side], wheel_angles=angles)
    (found,) = wandering_units(replace(still, segments=segments), prototype)
    assert found.coordinates == ("wander_l",)


def test_only_a_play_of_that_coupling_explains_how_far_a_rear_unit_wanders(
    still: Record, prototype: VehicleDescription
) -> None:
    left, right = still.segments
    problem, place = play(replace(still, segments=[hopping(left, [1], prototype), right]), prototype)
    block = problem.blocks[place]
    columns = {
        candidate.key: candidate.variants[0].columns[place]
        for candidate in problem.candidates
        if any(variant.columns[place] is not None for variant in candidate.variants)
    }
    assert (block.step, block.channel, block.unit) == (Step.STEERING_LEFT, Channel.KINEMATIC, "m")
    assert not block.baseline.any()
    assert list(columns) == ["backlash@steering_left"]
    column = columns["backlash@steering_left"]
    assert column is not None
    own = column[block.moving, 0]
    assert own @ block.target[block.moving] / (own @ own) == pytest.approx(GAP, rel=0.1)


def test_a_unit_whose_wheels_both_roll_further_does_not_wander(still: Record, prototype: VehicleDescription) -> None:
    """Its encoder is late."""
    left, right = still.segments
    assert wandering_units(replace(still, segments=[hopping(left, [0, 1], prototype), right]), prototype) == []


def test_a_soft_gear_of_one_side_leaves_both_sides_without_such_rows(
    still: Record, prototype: VehicleDescription
) -> None:
    left, right = still.segments
    torques, angles = left.motor_torques.copy(), left.wheel_angles.copy()
    torques[:, 1] = 2.0 * np.cos(2.0 * (left.time - left.time[0]))
    angles[:, 1] += 3e-4 * torques[:, 1]
    soft = replace(left, wheel_angles=angles, motor_torques=torques)
    assert wandering_units(replace(still, segments=[soft, right]), prototype) == []


def test_units_of_both_sides_that_hop_alike_are_the_floor(still: Record, prototype: VehicleDescription) -> None:
    left, right = still.segments
    both = [hopping(left, [1], prototype), hopping(right, [3], prototype)]
    assert wandering_units(replace(still, segments=both), prototype) == []


@pytest.mark.parametrize("angle", [0.0, 1.0], ids=["parked", "far from the middle"])
def test_a_side_is_not_judged_by_one_that_was_not_looked_at(
    angle: float, still: Record, prototype: VehicleDescription
) -> None:
    left, right = still.segments
    away = replace(
        right, steering_angles=np.full((len(right), 2), [0.0, angle]), wheel_angles=np.zeros((len(right), 4))
    )
    segments = [hopping(left, [1], prototype), away]
    assert wandering_units(replace(still, segments=segments), prototype) == []


def test_of_two_steps_of_a_side_the_one_in_which_its_unit_goes_furthest_tells_the_play(
    still: Record, prototype: VehicleDescription
) -> None:
    left, right = still.segments
    short = replace(hopping(left, [1], prototype, GAP / 4), step="steering_left_slow")
    segments = [short, hopping(left, [1], prototype), right]
    (found,) = wandering_units(replace(still, segments=segments), prototype)
    assert found.step == Step.STEERING_LEFT


def test_a_vehicle_whose_encoders_only_scatter_does_not_move(still: Record, prototype: VehicleDescription) -> None:
    generator = np.random.default_rng(3)
    standing = [
        replace(
            segment,
            steering_angles=np.zeros((len(segment), 2)),
            wheel_angles=size * generator.normal(size=(len(segment), 4)),
        )
        for segment, size in zip(still.segments, (1e-6, 1e-7), strict=True)
    ]
    with pytest.raises(RecordError, match="does not move"):
        sources_of(Record(standing), prototype.geometry, list(Step), processing_of([still]))


@pytest.mark.parametrize(("gap", "told"), [(0.5 * LEAST, False), (3 * LEAST, True)])
def test_a_range_that_encoders_could_leave_is_none(
    gap: float, told: bool, still: Record, prototype: VehicleDescription
) -> None:
    left, right = still.segments
    segments = [hopping(left, [1], prototype, gap), right]
    assert bool(wandering_units(replace(still, segments=segments), prototype)) == told

"""A rear unit that wanders in the play of its coupling while its side steers tells that play."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import ndimage

from ident.errors import RecordError
from ident.gap.problem import Channel, Problem
from ident.gap.vehicle.build import build_problem
from ident.gap.vehicle.ideal import Drive, ideal_record
from ident.gap.vehicle.sources import Source, processing_of, sources_of
from ident.gap.vehicle.wandering import LEAST, WINDOW, wandered, wanders
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


@settings(max_examples=20, deadline=None)
@given(gap=st.floats(1e-4, 5e-3), seed=st.integers(0, 1000))
def test_a_unit_that_hops_from_flank_to_flank_ranges_over_its_play(gap: float, seed: int) -> None:
    turned = np.stack([STEERED, STEERED + gap / 2 * flank(TIME, seed)], axis=1)
    across = wandered(STEERED, turned, np.ones(len(TIME), dtype=bool), DT)
    assert across.max() == pytest.approx(gap, rel=0.1)


@pytest.mark.parametrize("phase", [0.0, 1.0, 2.0])
def test_wheels_that_are_larger_or_eccentric_do_not_wander(phase: float) -> None:
    rolled = 1.2 * STEERED
    uneven = STEERED * 1.001 + 2e-3 / 1.2 * np.cos(rolled + phase)
    across = wandered(STEERED, np.stack([STEERED, uneven], axis=1), np.ones(len(TIME), dtype=bool), DT)
    assert across.max() < LEAST / 2


def test_nothing_is_said_where_a_window_leaves_what_is_looked_at() -> None:
    turned = np.stack([STEERED, STEERED + GAP / 2 * flank(TIME)], axis=1)
    looked_at = (TIME > 2) & (TIME < 5)
    across = wandered(STEERED, turned, looked_at, DT)
    found = TIME[across > 0]
    assert found.min() == pytest.approx(2 + WINDOW / 2, abs=3 * DT)
    assert found.max() == pytest.approx(5 - WINDOW / 2, abs=3 * DT)
    assert not wandered(STEERED, turned, looked_at & (TIME < 2 + 0.9 * WINDOW), DT).any()


def test_a_unit_that_mostly_stays_on_one_flank_tells_its_play_all_the_same() -> None:
    seldom = np.where(np.abs(TIME - 8.0) < 0.1, 1.0, -1.0)
    turned = np.stack([STEERED, STEERED + GAP / 2 * seldom], axis=1)
    assert wandered(STEERED, turned, TIME > 3, DT).max() == pytest.approx(GAP, rel=0.1)


def test_what_both_sides_show_is_the_floor() -> None:
    much, little = 3 * LEAST, 0.3 * LEAST
    assert wanders(much, [])
    assert wanders(much, [little])
    assert not wanders(much, [much])
    assert not wanders(little, [little])
    assert not wanders(little, [])


def hopping(segment: Segment, wheels: list[int], prototype: VehicleDescription) -> Segment:
    """Some wheels of the left side rolled by a unit that hops in a play."""
    lever = prototype.geometry.wheel_offset / prototype.geometry.wheel_radius
    angles = segment.wheel_angles.copy()
    for wheel in wheels:
        angles[:, wheel] += (-1.0, 1.0)[wheel] * lever * GAP / 2 * flank(segment.time)
    return replace(segment, wheel_angles=angles)


def steered_slowly(segment: Segment, side: int, prototype: VehicleDescription) -> Segment:
    """A side that steers within 0.3 rad, its wheels rolling with it."""
    lever = prototype.geometry.wheel_offset / prototype.geometry.wheel_radius
    alpha, angles = np.zeros((len(segment), 2)), np.zeros((len(segment), 4))
    alpha[:, side] = 0.3 * np.sin(2.0 * (segment.time - segment.time[0]))
    angles[:, 2 * side : 2 * side + 2] = (-1) ** side * lever * alpha[:, [side]] * [-1, 1]
    return replace(segment, steering_angles=alpha, wheel_angles=angles)


@pytest.fixture(scope="module")
def still(prototype: VehicleDescription) -> Record:
    record = ideal_record([Drive(Step.STEERING_LEFT), Drive(Step.STEERING_RIGHT)], prototype)
    return replace(record, segments=[steered_slowly(one, side, prototype) for side, one in enumerate(record.segments)])


def wandering(record: Record, prototype: VehicleDescription) -> list[Source]:
    found = sources_of(record, prototype.geometry, list(Step), processing_of([record]))
    return [source for source in found if source.own is not None]


def play(record: Record, prototype: VehicleDescription) -> tuple[Problem, int]:
    """The problem, and the number of the block of the unit that wanders."""
    problem = build_problem([record], prototype)
    return problem, [block.coordinate for block in problem.blocks].index("wander_l")


def test_a_plain_vehicle_has_no_rows_of_units_that_wander(still: Record, prototype: VehicleDescription) -> None:
    assert wandering(still, prototype) == []


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
    assert wandering(replace(still, segments=[hopping(left, [0, 1], prototype), right]), prototype) == []


def test_a_motor_that_rattles_for_a_moment_is_no_unit_that_wanders(
    still: Record, prototype: VehicleDescription
) -> None:
    left, right = still.segments
    angles = left.wheel_angles.copy()
    moment = np.abs(left.time - left.time.mean()) < 0.05 * np.ptp(left.time) / 3
    angles[:, 1] += 1e-3 * np.sin(440 * left.time) * moment
    assert wandering(replace(still, segments=[replace(left, wheel_angles=angles), right]), prototype) == []


def test_a_vehicle_whose_encoders_only_scatter_does_not_move(still: Record, prototype: VehicleDescription) -> None:
    left = still.segments[0]
    noise = 1e-6 * np.random.default_rng(3).normal(size=(len(left), 4))
    standing = replace(left, steering_angles=np.zeros((len(left), 2)), wheel_angles=noise)
    with pytest.raises(RecordError, match="does not move"):
        sources_of(Record([standing]), prototype.geometry, list(Step), processing_of([still]))

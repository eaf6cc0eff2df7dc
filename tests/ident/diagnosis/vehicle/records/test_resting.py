"""A motor that nothing loads while the other side steers drifts in its gear, and tells its play."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from ident.diagnosis.names import EffectName
from ident.diagnosis.problem import Channel
from ident.diagnosis.vehicle.build import build_problem
from ident.diagnosis.vehicle.experiment.ideal import Drive, ideal_record
from ident.diagnosis.vehicle.records.resting import moved_at_rest
from ident.effects import make_effect
from ident.records.record import Record, Step
from ident.vehicle.description import VehicleDescription

Array = NDArray[np.float64]

GAP, COMPLIANCE, LOAD = 8e-4, 5e-5, 1.5
"""Play [rad] of flanks [rad/Nm] that carry at most that load [Nm]."""
FARTHEST = GAP / 2 + COMPLIANCE * LOAD
TIME = np.arange(6000) * 0.002
EVERYWHERE = np.ones(len(TIME), dtype=np.bool_)


def drifting(time: Array) -> tuple[Array, Array]:
    """Angle (N,) [rad] and load (N,) [Nm] of a motor carried to and fro, farther than its flanks let it."""
    angle = np.clip(1.3 * FARTHEST * np.sin(2 * math.pi * 1.7 * time), -FARTHEST, FARTHEST)
    return angle, (angle - np.clip(angle, -GAP / 2, GAP / 2)) / COMPLIANCE


@settings(max_examples=20, deadline=None)
@given(gap=st.floats(3e-4, 5e-3), noise=st.floats(0.0, 5e-6), seed=st.integers(0, 1000))
def test_a_loose_motor_ranges_over_its_play(gap: float, noise: float, seed: int) -> None:
    angles = np.stack([gap / 2 * np.sin(9 * TIME), 1e-5 * np.sin(TIME)], axis=1)
    angles += noise * np.random.default_rng(seed).normal(size=angles.shape)
    assert moved_at_rest(angles, EVERYWHERE) == pytest.approx([gap, 0.0], rel=0.02, abs=1e-6 + 6 * noise)


def test_a_wheel_that_is_dragged_along_widens_no_play() -> None:
    """By 0.015 mrad a second: 0.03 mrad within two of them, 0.18 mrad in all of the step."""
    for dragged in (0.0, 1.5e-5, -1.5e-5):
        angles = np.stack([GAP / 2 * np.sin(9 * TIME) + dragged * TIME, dragged * TIME / 2], axis=1)
        assert moved_at_rest(angles, EVERYWHERE) == pytest.approx([GAP, 0.0], abs=3.2e-5)


def test_what_a_rigid_gear_moves_or_what_moves_far_from_the_middle_is_no_play() -> None:
    drift = np.sin(9 * TIME)
    assert not moved_at_rest(np.stack([3e-5 * drift, 0 * drift], axis=1), EVERYWHERE).any()
    assert not moved_at_rest(np.stack([GAP * drift, 0 * drift], axis=1), ~EVERYWHERE).any()


def test_what_both_motors_of_a_side_show_is_a_play_only_if_both_are_loose() -> None:
    drift = np.sin(9 * TIME)
    for other, loose in ((2e-5, [True, False]), (8e-5, [False, False]), (3e-4, [True, True])):
        moved = moved_at_rest(np.stack([2e-4 * drift, other / 2 * drift], axis=1), EVERYWHERE)
        assert (moved > 0).tolist() == loose


def loose_gears(
    prototype: VehicleDescription,
    wheels: Sequence[int],
    *,
    rattles: bool,
    share: float = 1.0,
    steps: Sequence[Step] = (Step.STEERING_RIGHT,),
) -> Record:
    """Motors of the left wheels that drift while the right side steers, and are shaken or not in the drive."""
    record = ideal_record([*(Drive(step) for step in steps), Drive(Step.STRAIGHT)], prototype)
    segments = []
    for segment in record.segments:
        angles, torques = segment.wheel_angles.copy(), segment.motor_torques.copy()
        angle, load = drifting(segment.time)
        for wheel in wheels:
            if segment.step == Step.STEERING_RIGHT:
                angles[:, wheel] += share * angle
                torques[:, wheel] += load / prototype.geometry.gear_ratio
            elif segment.step == Step.STRAIGHT:
                angles[:, wheel] += 5e-4 * np.sin(2 * math.pi * 60 * segment.time) * rattles
        segments.append(replace(segment, wheel_angles=angles, motor_torques=torques))
    return replace(record, segments=segments)


def at_standstill(record: Record, prototype: VehicleDescription) -> set[str]:
    """Coordinates of the rows of the steps at standstill."""
    blocks = build_problem([record], prototype).blocks
    return {block.coordinate for block in blocks if block.step != Step.STRAIGHT}


def test_its_range_is_a_row_that_only_its_gear_explains(prototype: VehicleDescription) -> None:
    problem = build_problem([loose_gears(prototype, [0], rattles=True)], prototype)
    place = [block.coordinate for block in problem.blocks].index("rest_fl")
    block = problem.blocks[place]
    explained = {
        candidate.key: candidate.variants[-1].columns[place]
        for candidate in problem.candidates
        if candidate.variants[-1].columns[place] is not None
    }
    assert (block.unit, block.channel) == ("m", Channel.KINEMATIC)
    assert set(explained) == {"backlash@drive_fl", "elasticity@drive_fl"}
    assert block.tolerance > prototype.geometry.wheel_radius * 5e-5
    column = explained["backlash@drive_fl"]
    assert column is not None
    inner = block.moving & (np.arange(len(block.moving)) > 60)
    inner &= np.convolve(~block.moving, np.ones(121), "same") == 0
    left = (block.target - column @ [GAP, COMPLIANCE])[inner]
    assert np.abs(left).max() < 0.03 * np.abs(block.target[inner]).max()


def test_what_rolls_at_standstill_is_left_out_beside_it_whichever_side_steers(prototype: VehicleDescription) -> None:
    steps = [Step.STEERING_LEFT, Step.STEERING_RIGHT]
    found = at_standstill(loose_gears(prototype, [0], rattles=True, steps=steps), prototype)
    assert found == {"alpha_l", "alpha_r", "rest_fl"}


def test_beside_a_narrow_range_wheels_tell_how_they_roll(prototype: VehicleDescription) -> None:
    found = at_standstill(loose_gears(prototype, [0], rattles=True, share=0.5), prototype)
    assert found == {"alpha_r", "rest_fl", "roll_fr", "roll_rr"}


def test_two_loose_motors_of_a_side_have_a_row_each(prototype: VehicleDescription) -> None:
    found = at_standstill(loose_gears(prototype, [0, 1], rattles=True), prototype)
    assert found == {"alpha_r", "rest_fl", "rest_rl"}


def test_a_motor_that_rattles_nowhere_is_not_taken_to_be_loose(prototype: VehicleDescription) -> None:
    found = at_standstill(loose_gears(prototype, [0], rattles=False), prototype)
    assert found == {"alpha_r", "roll_fr", "roll_rr"}


def test_a_given_play_that_is_too_large_leaves_a_row_that_its_gear_can_still_explain(
    prototype: VehicleDescription,
) -> None:
    given = make_effect(EffectName.BACKLASH, "drive_fl", {"gap": 2 * GAP})
    problem = build_problem([loose_gears(prototype, [0], rattles=True)], prototype, given=[given])
    place = [block.coordinate for block in problem.blocks].index("rest_fl")
    column = problem.candidate("elasticity@drive_fl").variants[0].columns[place]
    assert column is not None
    assert np.any(column != 0)

"""A motor that nothing loads while the other side steers drifts in its gear, and tells its play."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from ident.gap.problem import Channel, Problem
from ident.gap.vehicle.build import build_problem
from ident.gap.vehicle.ideal import Drive, ideal_record
from ident.gap.vehicle.resting import is_loose, moved_at_rest
from ident.records.record import Record, Step
from ident.vehicle.description import VehicleDescription

Array = NDArray[np.float64]

GAP, COMPLIANCE, LOAD = 8e-4, 5e-5, 1.5
"""Play [rad] of flanks [rad/Nm] that carry at most that load [Nm]."""
FARTHEST = GAP / 2 + COMPLIANCE * LOAD


def drifting(time: Array) -> tuple[Array, Array]:
    """Angle (N,) [rad] and load (N,) [Nm] of a motor carried to and fro, farther than its flanks let it."""
    angle = np.clip(1.3 * FARTHEST * np.sin(2 * math.pi * 1.7 * time), -FARTHEST, FARTHEST)
    return angle, (angle - np.clip(angle, -GAP / 2, GAP / 2)) / COMPLIANCE


@settings(max_examples=20, deadline=None)
@given(gap=st.floats(3e-4, 5e-3), noise=st.floats(0.0, 5e-6), seed=st.integers(0, 1000))
def test_a_loose_motor_ranges_over_its_play_and_the_other_one_over_nothing(gap: float, noise: float, seed: int) -> None:
    time = np.arange(6000) * 0.002
    angles = np.stack([gap / 2 * np.sin(9 * time), 1e-5 * np.sin(time)], axis=1)
    angles += noise * np.random.default_rng(seed).normal(size=angles.shape)
    across = moved_at_rest(angles, np.ones(len(time), dtype=np.bool_))
    assert across[0] == pytest.approx(gap, rel=0.02, abs=1e-6 + 6 * noise)
    assert across[1] == 0.0


def test_motors_that_the_chassis_carries_along_are_not_loose() -> None:
    pushed = 1e-3 * np.sin(np.arange(6000) * 0.01)
    near = np.ones(len(pushed), dtype=np.bool_)
    assert not moved_at_rest(np.stack([pushed, 0.8 * pushed], axis=1), near).any()
    assert not moved_at_rest(np.stack([pushed, 0.1 * pushed], axis=1), ~near).any()
    assert is_loose(5e-3, [5e-3, 3e-4])
    assert not is_loose(3e-4, [5e-3, 3e-4])


def loose_gear(prototype: VehicleDescription, *, rattles: bool) -> Record:
    """The motor of the first wheel drifts while the right side steers, and is shaken or not in the drive."""
    record = ideal_record([Drive(Step.STEERING_RIGHT), Drive(Step.STRAIGHT)], prototype)
    resting, driving = record.segments
    angles, torques = resting.wheel_angles.copy(), resting.motor_torques.copy()
    angle, load = drifting(resting.time)
    angles[:, 0] += angle
    torques[:, 0] += load / prototype.geometry.gear_ratio
    shaken = driving.wheel_angles.copy()
    shaken[:, 0] += 5e-4 * np.sin(2 * math.pi * 60 * driving.time) * rattles
    segments = [replace(resting, wheel_angles=angles, motor_torques=torques), replace(driving, wheel_angles=shaken)]
    return replace(record, segments=segments)


def coordinates(problem: Problem) -> set[str]:
    """Of the rows of the step at standstill."""
    return {block.coordinate for block in problem.blocks if block.step == Step.STEERING_RIGHT}


def test_its_range_is_a_row_that_only_its_gear_explains(prototype: VehicleDescription) -> None:
    problem = build_problem([loose_gear(prototype, rattles=True)], prototype)
    place = [block.coordinate for block in problem.blocks].index("rest_fl")
    block = problem.blocks[place]
    explained = {
        candidate.key: candidate.variants[-1].columns[place]
        for candidate in problem.candidates
        if candidate.variants[-1].columns[place] is not None
    }
    assert (block.unit, block.channel) == ("m", Channel.KINEMATIC)
    assert set(explained) == {"backlash@drive_fl", "elasticity@drive_fl"}
    column = explained["backlash@drive_fl"]
    assert column is not None
    inner = block.moving & (np.arange(len(block.moving)) > 60)
    inner &= np.convolve(~block.moving, np.ones(121), "same") == 0
    left = (block.target - column @ [GAP, COMPLIANCE])[inner]
    assert np.abs(left).max() < 0.03 * np.abs(block.target[inner]).max()


def test_what_rolls_at_standstill_is_left_out_beside_it(prototype: VehicleDescription) -> None:
    assert coordinates(build_problem([loose_gear(prototype, rattles=True)], prototype)) == {"alpha_r", "rest_fl"}


def test_a_motor_that_rattles_nowhere_is_not_taken_to_be_loose(prototype: VehicleDescription) -> None:
    found = coordinates(build_problem([loose_gear(prototype, rattles=False)], prototype))
    assert found == {"alpha_r", "roll_fr", "roll_rr"}

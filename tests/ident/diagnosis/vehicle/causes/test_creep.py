"""Wheels that creep in proportion to their traction: how much comes out, and no cause is named for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.diagnosis.names import EffectName
from ident.diagnosis.problem import Channel, Problem
from ident.diagnosis.vehicle.build import build_problem
from ident.diagnosis.vehicle.causes.creep import CREEP_NAMES, GRANTED
from ident.diagnosis.vehicle.experiment.ideal import FOUR, ideal_record
from ident.records.record import Record, Segment, Step
from ident.vehicle.description import VehicleDescription
from ident.vehicle.parameters import PARAMETER_NAMES

Array = NDArray[np.float64]

CREEP = np.array([0.02, 0.008, 0.012, 0.03])
"""Slip of each wheel for a traction as large as its load [-]."""
MORE = 0.02
"""By how much more they slip turning on the spot [-]."""

COLUMNS = slice(len(PARAMETER_NAMES), len(PARAMETER_NAMES) + len(CREEP_NAMES))
"""Of creep, in the baseline."""

WHEELS = slice(COLUMNS.start, COLUMNS.start + len(CREEP))
"""Of that, the wheels'."""


def creeping(
    segment: Segment, vehicle: VehicleDescription, step: Step = Step.STRAIGHT, creep: Array | float = CREEP
) -> Segment:
    """A drive whose four wheels push by a quarter each, and turn ahead in proportion to that over their load."""
    if segment.step != step:
        return segment
    radius, dt = vehicle.geometry.wheel_radius, segment.sample_time
    speed = radius * np.gradient(segment.wheel_angles, dt, axis=0)
    inertia = sum(vehicle.prior[name] for name in ("C_ch", "C_l", "C_r")) / vehicle.geometry.rotation_lever**2
    pushed = 1.0 if step == Step.STRAIGHT else inertia / vehicle.prior["m_ch"]
    adhesion = pushed * np.gradient(speed, dt, axis=0) / 9.81
    ahead = np.cumsum(creep * np.abs(speed) * adhesion, axis=0) * dt / radius
    return replace(segment, wheel_angles=segment.wheel_angles + ahead)


@pytest.fixture(scope="module")
def problem(prototype: VehicleDescription) -> Problem:
    record = ideal_record(FOUR, prototype)
    record = Record([creeping(segment, prototype) for segment in record.segments], "creeping")
    return build_problem([record], prototype, prototype.prior, effects=(EffectName.STEERING_OFFSET,))


def rolling(problem: Problem) -> tuple[Array, Array, Array]:
    """Creep's columns, the column of an askew wheel and the target of the straight drive's rolling rows."""
    variant = problem.candidate("steering_offset@steering_left").variants[0]
    parts = [
        (block.baseline[:, WHEELS], column, block.target, block.moving)
        for block, column in zip(problem.blocks, variant.columns, strict=True)
        if block.channel is Channel.KINEMATIC and block.step == Step.STRAIGHT
    ]
    creep, column, target = [], [], []
    for own, askew, measured, moving in parts:
        creep.append(own[moving])
        column.append(askew[moving][:, :1] if askew is not None else np.zeros((int(moving.sum()), 1)))
        target.append(measured[moving])
    return np.concatenate(creep), np.concatenate(column)[:, 0], np.concatenate(target)


def test_what_differs_between_the_wheels_creep_comes_out(problem: Problem) -> None:
    creep, _, target = rolling(problem)
    found = np.linalg.lstsq(creep, target, rcond=1e-6)[0]
    # What all four have in common turns no wheel against another, and cannot be seen there.
    assert found - found.mean() == pytest.approx(CREEP - CREEP.mean(), abs=1e-3)
    assert np.sqrt(np.mean((target - creep @ found) ** 2)) < 0.1 * np.sqrt(np.mean(target**2))


def test_what_the_wheels_creep_in_common_comes_out_of_the_forces(
    problem: Problem, prototype: VehicleDescription
) -> None:
    """The vehicle speeds up by less than its wheels do."""
    (block,) = [one for one in problem.blocks if one.step == Step.STRAIGHT and one.channel is Channel.DYNAMIC]
    known = block.baseline[:, : len(PARAMETER_NAMES)] @ prototype.prior.values
    together = block.baseline[block.moving][:, WHEELS].sum(axis=1)
    missing = (block.target - known)[block.moving]
    found = float(together @ missing) / float(together @ together)
    # What the wheels take to spin up, beside the vehicle, is not in the torques of these records.
    spinning = 4 * prototype.prior["B_w"] / prototype.geometry.wheel_radius**2 / prototype.prior["m_ch"]
    assert found == pytest.approx((1 + spinning) * CREEP.mean(), rel=0.02)
    assert np.sqrt(np.mean((missing - found * together) ** 2)) < 0.1 * np.sqrt(np.mean(missing**2))


def test_turning_on_the_spot_all_wheels_may_creep_by_another_number(prototype: VehicleDescription) -> None:
    """Driving straight by `CREEP`, turning by `MORE` more: both come out of the forces of the two."""
    record = ideal_record(FOUR, prototype)
    segments = [creeping(creeping(one, prototype), prototype, Step.ROTATION, MORE) for one in record.segments]
    problem = build_problem([Record(segments, "creeping")], prototype, prototype.prior, effects=(EffectName.PAYLOAD,))
    (block,) = [one for one in problem.blocks if one.step == Step.ROTATION and one.channel is Channel.DYNAMIC]
    missing = (block.target - block.baseline[:, : len(PARAMETER_NAMES)] @ prototype.prior.values)[block.moving]
    turning = block.baseline[block.moving][:, COLUMNS.stop - 1]
    assert float(turning @ missing) / float(turning @ turning) == pytest.approx(MORE, rel=0.15)
    straight = [one.baseline[:, COLUMNS.stop - 1] for one in problem.blocks if one.step != Step.ROTATION]
    assert not np.concatenate(straight).any()


def test_creep_does_not_look_like_wheels_that_stand_askew(problem: Problem) -> None:
    """Traction goes with the acceleration, an offset with the speed: driving to and fro, they have little in common."""
    creep, askew, target = rolling(problem)
    cosines = creep.T @ askew / np.linalg.norm(creep, axis=0) / np.linalg.norm(askew)
    assert np.abs(cosines).max() < 0.2
    assert abs(float(target @ askew) / float(askew @ askew)) < 3e-5


def test_creep_is_known_to_be_small_and_no_parameter_of_the_model(problem: Problem) -> None:
    assert problem.names[COLUMNS] == CREEP_NAMES
    assert problem.nominal is not None
    assert not problem.nominal.values[len(PARAMETER_NAMES) :].any()
    assert all(0.01 <= problem.spreads[name][1] <= 0.1 for name in CREEP_NAMES)


def test_less_is_tolerated_than_wheels_may_creep(problem: Problem, prototype: VehicleDescription) -> None:
    radius = prototype.geometry.wheel_radius
    record = ideal_record(FOUR, prototype)
    segment = next(one for one in record.segments if one.step == Step.STRAIGHT)
    speed = radius * np.gradient(segment.wheel_angles, segment.sample_time, axis=0)
    fastest = float(np.abs(speed).max())
    for block in problem.blocks:
        if block.channel is Channel.KINEMATIC and block.step == Step.STRAIGHT:
            assert 0 < block.tolerance < GRANTED * fastest / 2, block.label


def test_contacts_may_give_way_more_the_faster_they_roll(problem: Problem) -> None:
    """Of rms one over the rows that are used; half of its power at rest as well."""
    rolls = [block for block in problem.blocks if block.channel is Channel.KINEMATIC]
    assert rolls
    for block in rolls:
        assert block.tolerated is not None
        assert np.sqrt(np.mean(block.tolerated[block.moving] ** 2)) == pytest.approx(1.0)
        assert block.tolerated.min() == pytest.approx(np.sqrt(0.5), rel=1e-3)
    straight = next(block for block in rolls if block.step == Step.STRAIGHT)
    assert straight.tolerated is not None
    assert straight.features is not None
    power = straight.features[:, 1] ** 2
    assert np.corrcoef(power, straight.tolerated**2)[0, 1] > 0.999
    assert all(block.tolerated is None for block in problem.blocks if block.channel is Channel.DYNAMIC)

"""Rows of a perfect vehicle hold, and what is wrong with a flawed one shows in its own column, with its own size."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.diagnosis.names import EffectName
from ident.diagnosis.problem import Block, Channel, Problem
from ident.diagnosis.vehicle.build import build_problem
from ident.diagnosis.vehicle.causes.context import make_context
from ident.diagnosis.vehicle.experiment.ideal import DIAGNOSTIC, FOUR, Drive, ideal_record
from ident.diagnosis.vehicle.records.sources import DIAGNOSED, DRY, SLIDING, sources_of
from ident.effects import make_effect
from ident.estimate.equations import equations_of
from ident.estimate.filters import Processing
from ident.records.record import Record, Segment, Step
from ident.vehicle.description import VehicleDescription
from ident.vehicle.parameters import PARAMETER_NAMES

Array = NDArray[np.float64]
Flaw = Callable[[Segment], Segment]


def problem_of(record: Record, vehicle: VehicleDescription, *names: EffectName) -> Problem:
    return build_problem([record], vehicle, vehicle.prior, effects=names or (EffectName.TORQUE_BIAS,))


def flawed(record: Record, flaw: Flaw) -> Record:
    return replace(record, segments=[flaw(segment) for segment in record.segments])


def of_the_model(block: Block) -> Array:
    """Regressor of the parameters of (18), without the creep of the wheels."""
    return block.baseline[:, : len(PARAMETER_NAMES)]


def recovered(problem: Problem, key: str, vehicle: VehicleDescription, channel: Channel | None = None) -> Array:
    """Size by least squares over all rows in which the cause acts, parameters held."""
    columns, left = [], []
    for block, column in zip(problem.blocks, problem.candidate(key).variants[0].columns, strict=True):
        if column is not None and channel in (None, block.channel):
            columns.append(column[block.moving])
            left.append((block.target - of_the_model(block) @ vehicle.prior.values)[block.moving])
    return np.linalg.lstsq(np.concatenate(columns), np.concatenate(left), rcond=None)[0]


def test_a_perfect_vehicle_leaves_nothing(vehicle: VehicleDescription) -> None:
    for block in problem_of(ideal_record(FOUR, vehicle), vehicle).blocks:
        left = (block.target - of_the_model(block) @ vehicle.prior.values)[block.moving]
        scale = np.abs(block.target).max() if block.channel is Channel.DYNAMIC else 1.0
        assert np.abs(left).max() < 3e-3 * scale, block.label
        if block.channel is Channel.KINEMATIC:
            assert np.sqrt(np.mean(left**2)) < block.tolerance, block.label
        else:
            assert block.tolerance == 0.0, block.label


LOADED = DIAGNOSTIC["known payload"].drives


@pytest.mark.parametrize("experiment", ["known payload", "on a slope"])
def test_what_is_known_of_load_and_floor_is_part_of_the_model(experiment: str, vehicle: VehicleDescription) -> None:
    driven, gains = DIAGNOSTIC[experiment], (EffectName.TORQUE_GAIN,)
    record = ideal_record(driven.drives, vehicle)
    for block in build_problem([record], vehicle, vehicle.prior, given=driven.given, effects=gains).blocks:
        if block.channel is Channel.DYNAMIC:
            left = (block.target - of_the_model(block) @ vehicle.prior.values)[block.moving]
            assert np.abs(left).max() < 3e-3 * np.abs(block.target).max(), block.label


def test_a_load_that_the_record_does_not_state_is_found_as_a_payload(vehicle: VehicleDescription) -> None:
    silent = flawed(ideal_record(LOADED, vehicle), lambda segment: replace(segment, extra={}))
    problem = problem_of(silent, vehicle, EffectName.PAYLOAD)
    mass, _ = recovered(problem, "payload@chassis", vehicle)
    assert mass == pytest.approx(LOADED[0].payload, rel=0.01)


def test_dynamic_rows_are_those_of_the_estimator_and_some_beside_what_sticks(vehicle: VehicleDescription) -> None:
    record, filters = ideal_record(FOUR, vehicle), Processing(moving=SLIDING, guard=0.2)
    every = build_problem([record], vehicle, vehicle.prior, effects=(EffectName.TORQUE_BIAS,), processing=filters)
    blocks = [block for block in every.blocks if block.channel is Channel.DYNAMIC]
    estimated = [one for each in record.segments for one in equations_of(each, vehicle.geometry, filters, DRY)]
    for block, equations in zip(blocks, estimated, strict=True):
        step = round(block.sample_time / equations.sample_time)
        scale = np.abs(equations.regressor).max(axis=0) + 1e-12
        kept = equations.moving[::step]
        assert np.all(block.moving[kept])
        assert block.moving.sum() > kept.sum()
        assert np.allclose((of_the_model(block) / scale)[kept], (equations.regressor[::step] / scale)[kept], atol=5e-3)
        loudest = np.abs(equations.torque).max()
        assert np.allclose(block.target[kept], equations.torque[::step][kept], atol=2e-3 * loudest)


def test_what_holds_a_joint_that_sticks_is_hardly_in_the_rows_about_it(vehicle: VehicleDescription) -> None:
    """A jerk of one motor before and behind the moment in which the steering turns round, and where it moves: what is
    left is what torques' own filter makes of it.
    """
    record = ideal_record(FOUR, vehicle)

    def jerked(after: int) -> Flaw:
        def flaw(segment: Segment) -> Segment:
            if segment.step != Step.STEERING_LEFT:
                return segment
            rate = np.gradient(segment.steering_angles[:, 0], segment.time)
            turns = np.flatnonzero(np.diff(np.sign(rate)) != 0) + after
            torques = segment.motor_torques.copy()
            torques[turns[turns < len(torques)], 0] += 1.0
            return replace(segment, motor_torques=torques)

        return flaw

    def change(after: int) -> float:
        made = [problem_of(one, vehicle).blocks for one in (record, flawed(record, jerked(after)))]
        pairs = zip(*made, strict=True)
        of_step = [pair for pair in pairs if (pair[0].channel, pair[0].step) == (Channel.DYNAMIC, "steering_left")]
        return max(float(np.abs(one.target - other.target)[one.moving].max()) for one, other in of_step)

    assert max(change(0), change(1)) < 0.03 * change(60)


def test_a_bias_of_one_motor_is_found_at_its_drive(vehicle: VehicleDescription) -> None:
    def flaw(segment: Segment) -> Segment:
        return replace(segment, motor_torques=segment.motor_torques - np.array([0, 0.05, 0, 0]))

    problem = problem_of(flawed(ideal_record(FOUR, vehicle), flaw), vehicle)
    assert recovered(problem, "torque_bias@drive_rl", vehicle) == pytest.approx(0.05, rel=0.02)


@pytest.mark.parametrize("velocity", [0.4, 0.05])
def test_friction_that_rises_towards_rest_is_found_with_its_amplitude(
    velocity: float, vehicle: VehicleDescription
) -> None:
    g = vehicle.geometry

    def flaw(segment: Segment) -> Segment:
        rate = np.gradient(segment.steering_angles[:, 1], segment.sample_time)
        extra = 4.0 * np.exp(-((rate / velocity) ** 2)) * np.sign(rate)
        wheels = extra * g.wheel_radius / (2 * g.wheel_offset * g.gear_ratio)
        change = np.stack([0 * wheels, 0 * wheels, wheels, -wheels], axis=1)
        return replace(segment, motor_torques=segment.motor_torques + change)

    problem = problem_of(flawed(ideal_record(FOUR, vehicle), flaw), vehicle, EffectName.STRIBECK)
    candidate = problem.candidate("stribeck@steering_right")
    values = [float(variant.start(np.array([1.0]))[1]) for variant in candidate.variants if variant.start]
    chosen = replace(candidate, variants=(candidate.variants[values.index(velocity)],))
    only = replace(problem, candidates=(chosen,))
    assert recovered(only, candidate.key, vehicle) == pytest.approx(4.0, rel=0.03)


@pytest.mark.parametrize("wheel", [0, 3])
def test_a_small_wheel_turns_faster(wheel: int, vehicle: VehicleDescription) -> None:
    error = -0.004 * vehicle.geometry.wheel_radius

    def flaw(segment: Segment) -> Segment:
        factor = np.ones(4)
        factor[wheel] = vehicle.geometry.wheel_radius / (vehicle.geometry.wheel_radius + error)
        return replace(segment, wheel_angles=segment.wheel_angles * factor)

    problem = problem_of(flawed(ideal_record(FOUR, vehicle), flaw), vehicle, EffectName.WHEEL_RADIUS)
    place = ("wheel_fl", "wheel_rl", "wheel_fr", "wheel_rr")[wheel]
    found = recovered(problem, f"wheel_radius@{place}", vehicle, Channel.KINEMATIC)
    assert found == pytest.approx(error, rel=0.01)


def test_an_encoder_that_is_late_breaks_the_rolling_of_its_side(vehicle: VehicleDescription) -> None:
    delay = 0.008

    def flaw(segment: Segment) -> Segment:
        late = np.interp(segment.time - delay, segment.time, segment.steering_angles[:, 0])
        return replace(segment, steering_angles=np.stack([late, segment.steering_angles[:, 1]], axis=1))

    problem = problem_of(flawed(ideal_record(FOUR, vehicle), flaw), vehicle, EffectName.TIME_DELAY)
    found = recovered(problem, "time_delay@encoder_left", vehicle, Channel.KINEMATIC)
    assert found == pytest.approx(delay, rel=0.05)
    other = recovered(problem, "time_delay@encoder_right", vehicle, Channel.KINEMATIC)
    assert abs(float(other[0])) < 1e-3


def test_a_drive_that_is_late_shows_with_torque_dither(vehicle: VehicleDescription) -> None:
    delay = 0.01

    def flaw(segment: Segment) -> Segment:
        early = np.interp(segment.time + delay, segment.time, segment.motor_torques[:, 2])
        torques = segment.motor_torques.copy()
        torques[:, 2] = early
        return replace(segment, motor_torques=torques)

    record = ideal_record([*FOUR, *DIAGNOSTIC["torque dither"].drives], vehicle)
    problem = problem_of(flawed(record, flaw), vehicle, EffectName.TIME_DELAY)
    assert recovered(problem, "time_delay@drive_fr", vehicle, Channel.DYNAMIC) == pytest.approx(delay, rel=0.1)


def test_uphill_is_where_the_vehicle_is_pulled_back_whatever_its_heading(vehicle: VehicleDescription) -> None:
    weight = vehicle.prior["m_ch"] * 9.80665 * np.sin(0.01)
    back = weight * vehicle.geometry.wheel_radius / (4 * vehicle.geometry.gear_ratio)

    def flaw(segment: Segment) -> Segment:
        uphill = {"straight": 1.0, "straight_turned": -1.0}.get(segment.step, 0.0)
        return replace(segment, motor_torques=segment.motor_torques + uphill * back)

    record = ideal_record([*FOUR, *DIAGNOSTIC["two headings"].drives], vehicle)
    problem = problem_of(flawed(record, flaw), vehicle, EffectName.SLOPE)
    variant = problem.candidate("slope@chassis").variants[0]
    assert variant.start is not None
    angle, direction = variant.start(recovered(problem, "slope@chassis", vehicle))
    assert (angle, direction) == (pytest.approx(0.01, rel=0.02), 0.0)


def test_an_effect_that_the_model_has_leaves_nothing(vehicle: VehicleDescription) -> None:
    def flaw(segment: Segment) -> Segment:
        return replace(segment, motor_torques=segment.motor_torques - np.array([0, 0.05, 0, 0]))

    record = flawed(ideal_record(FOUR, vehicle), flaw)
    known = [make_effect(EffectName.TORQUE_BIAS, "drive_rl", {"bias": 0.05})]
    problem = build_problem([record], vehicle, vehicle.prior, given=known, effects=[EffectName.TORQUE_BIAS])
    assert abs(float(recovered(problem, "torque_bias@drive_rl", vehicle)[0])) < 1e-3


def test_exact_contributions_begin_as_their_columns(vehicle: VehicleDescription) -> None:
    problem = build_problem([ideal_record(FOUR, vehicle)], vehicle, vehicle.prior)
    for candidate in problem.candidates:
        variant = candidate.variants[0]
        acts = any(column is not None for column in variant.columns)
        if candidate.contribution is None or variant.start is None or not acts:
            continue
        width = next(column.shape[1] for column in variant.columns if column is not None)
        small = np.full(width, 1e-6)
        exact = candidate.contribution(variant.start(small), vehicle.prior.values)
        for column, change in zip(variant.columns, exact, strict=True):
            expected = np.zeros(1) if column is None else column @ small
            scale = 1e-12 + np.abs(expected).max()
            assert np.allclose((0.0 if change is None else change) / scale, expected / scale, atol=1e-3), candidate.key


@pytest.mark.parametrize("lifted", [False, True])
def test_forces_inside_take_the_inertia_of_wheels_from_those_that_turn_in_the_air(
    lifted: bool, vehicle: VehicleDescription
) -> None:
    """One motor swings against its wheel, which rows on the floor would explain by any inertia."""
    record = ideal_record([*FOUR, Drive(Step.WHEEL_LIFTED)] if lifted else FOUR, vehicle)

    def swinging(segment: Segment) -> Segment:
        swing = 5e-4 * np.sin(40.0 * segment.time) * (segment.step == Step.STRAIGHT)
        return replace(segment, wheel_angles=segment.wheel_angles + swing[:, None] * np.eye(4)[0])

    guess = 1.2 * vehicle.prior.values
    wrong = replace(vehicle, prior=replace(vehicle.prior, values=guess))
    sources = sources_of(flawed(record, swinging), wrong.geometry, DIAGNOSED, Processing())
    found = make_context(sources, wrong, None, (), Processing()).known[PARAMETER_NAMES.index("B_w")]
    truth = vehicle.prior.values[-1] if lifted else guess[-1]
    assert found == pytest.approx(truth, rel=0.09)

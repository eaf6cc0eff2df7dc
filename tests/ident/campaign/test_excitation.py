from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ident.campaign.axis import axis_of
from ident.campaign.excitation import FourierSeries, motion_basis, resting_projection, series_of
from ident.campaign.optimise import (
    ADHESION_RESERVE,
    GRAVITY,
    LIMITS,
    SAMPLES,
    TORQUE_RESERVE,
    Excitation,
    Problem,
    condition_number,
    optimise,
    size_within_limits,
)
from ident.campaign.reference import excitation_reference
from ident.campaign.steps import EXCITATIONS, PERIODS, StepSpec
from ident.estimate.filters import Processing
from ident.records.record import Step
from ident.vehicle.description import VehicleDescription, load_vehicle

property_of = settings(max_examples=25, deadline=None, derandomize=True)
steps = pytest.mark.parametrize("step", list(EXCITATIONS))
CYCLE = 0.002
BETWEEN_SAMPLES = 1.01
"""Limits are judged at 240 points of a period; between them a motion may be a little larger."""


def problem_of(spec: StepSpec, vehicle: VehicleDescription) -> Problem:
    axis = axis_of(spec, vehicle)
    return Problem(spec, axis, vehicle.limits, vehicle.geometry.gear_ratio, vehicle.prior["m_ch"], Processing())


def sized(spec: StepSpec, vehicle: VehicleDescription, seed: int) -> tuple[FourierSeries, str]:
    shape = resting_projection(spec.harmonics) @ np.random.default_rng(seed).normal(size=2 * spec.harmonics)
    time = np.arange(SAMPLES) * spec.period / SAMPLES
    position, velocity, acceleration = (b @ shape for b in motion_basis(time, spec.period, spec.harmonics))
    factor, binding = size_within_limits((position, velocity, acceleration), problem_of(spec, vehicle))
    return series_of(factor * shape, spec.period), binding


@property_of
@given(coefficients=st.lists(st.floats(-5, 5), min_size=12, max_size=12), period=st.floats(2.0, 10.0))
def test_excitation_starts_and_ends_at_rest_and_repeats(coefficients: list[float], period: float) -> None:
    series = series_of(resting_projection(6) @ np.array(coefficients), period)
    ends = np.array([0.0, period, 3 * period])
    for values in series.evaluate(ends):
        np.testing.assert_allclose(values, 0.0, atol=1e-9)
    time = np.linspace(0, period, 50)
    for first, later in zip(series.evaluate(time), series.evaluate(time + 2 * period), strict=True):
        np.testing.assert_allclose(first, later, atol=1e-9)


def test_a_projection_to_rest_is_one_and_leaves_ten_shapes() -> None:
    projection = resting_projection(6)
    np.testing.assert_allclose(projection @ projection, projection, atol=1e-12)
    np.testing.assert_allclose(projection, projection.T)
    assert np.linalg.matrix_rank(projection) == 10


def test_velocity_and_acceleration_are_derivatives_of_the_position() -> None:
    series = FourierSeries(np.array([0.4, -0.1]), np.array([0.2, 0.5]), 3.0)
    time, h = np.linspace(0.1, 2.9, 30), 1e-5
    position, velocity, acceleration = series.evaluate(time)
    (ahead, ahead_rate, _), (behind, behind_rate, _) = series.evaluate(time + h), series.evaluate(time - h)
    np.testing.assert_allclose(velocity, (ahead - behind) / (2 * h), atol=1e-8)
    np.testing.assert_allclose(acceleration, (ahead_rate - behind_rate) / (2 * h), atol=1e-7)
    for whole, half in zip((position, velocity, acceleration), series.scaled(0.5).evaluate(time), strict=True):
        np.testing.assert_allclose(half, whole / 2)


def assert_within_limits(spec: StepSpec, series: FourierSeries, vehicle: VehicleDescription) -> None:
    """On the references as driven, with torques of the full model, not of the axis that planned them."""
    reference = excitation_reference(spec, series, PERIODS, vehicle, vehicle.prior, CYCLE)
    time = CYCLE * np.arange(round(spec.period / CYCLE))
    position, velocity, acceleration = series.evaluate(time)
    limits, geometry = vehicle.limits, vehicle.geometry
    assert np.abs(position).max() <= BETWEEN_SAMPLES * spec.stroke
    assert np.abs(velocity).max() <= BETWEEN_SAMPLES * spec.speed
    assert np.abs(acceleration).max() <= BETWEEN_SAMPLES * spec.acceleration
    wheels = np.max([np.abs(track.velocity[:, None] * track.wheels).max() for track in reference.tracks.values()])
    assert wheels * geometry.gear_ratio <= BETWEEN_SAMPLES * limits.motor_speed
    torque = np.abs(reference.feed_forward)
    assert torque.max() <= BETWEEN_SAMPLES * TORQUE_RESERVE * limits.peak_torque
    driven = reference.feed_forward[reference.period >= 0]
    assert np.sqrt(np.mean(driven**2, axis=0)).max() <= BETWEEN_SAMPLES * limits.rated_torque
    if spec.mode is not None:
        grip = limits.floor_friction * vehicle.prior["m_ch"] * GRAVITY / 4
        push = torque.max() * geometry.gear_ratio / geometry.wheel_radius
        assert push <= BETWEEN_SAMPLES * ADHESION_RESERVE * grip
    start = spec.steering(geometry)
    if spec.coordinate.startswith("alpha"):
        assert np.abs(start).max() + np.abs(position).max() <= geometry.steering_limit


@steps
@pytest.mark.parametrize("seed", range(3))
def test_excitation_keeps_every_limit_and_touches_one(step: Step, seed: int, vehicle: VehicleDescription) -> None:
    spec = EXCITATIONS[step]
    series, binding = sized(spec, vehicle, seed)
    assert_within_limits(spec, series, vehicle)
    problem = problem_of(spec, vehicle)
    time = np.arange(SAMPLES) * spec.period / SAMPLES
    usage = problem.usage(series.evaluate(time))
    assert usage.max() == pytest.approx(1.0, abs=1e-4)
    assert LIMITS[int(usage.argmax())] == binding


@steps
def test_many_motions_are_judged_as_each_of_them_is(step: Step, vehicle: VehicleDescription) -> None:
    spec = EXCITATIONS[step]
    problem = problem_of(spec, vehicle)
    time = np.arange(SAMPLES) * spec.period / SAMPLES
    motions = [sized(spec, vehicle, seed)[0].evaluate(time) for seed in range(3)]
    stacked = tuple(np.stack(parts) for parts in zip(*motions, strict=True))
    usage, normal = problem.usage(stacked), problem.normal_matrix(stacked)
    for index, motion in enumerate(motions):
        assert usage[:, index] == pytest.approx(problem.usage(motion))
        assert normal[index] == pytest.approx(problem.normal_matrix(motion))
        assert condition_number(normal)[index] == pytest.approx(float(condition_number(normal[index])))


def test_a_condition_number_is_that_of_unit_columns() -> None:
    columns = np.random.default_rng(0).normal(size=(3, 100)) * np.array([[1.0], [1e3], [1e-3]])
    unit = columns / np.linalg.norm(columns, axis=1, keepdims=True)
    singular = np.linalg.svd(unit, compute_uv=False)
    assert condition_number(columns @ columns.T) == pytest.approx((singular[0] / singular[-1]) ** 2)


def assert_better_than_random(spec: StepSpec, found: Excitation, vehicle: VehicleDescription) -> None:
    problem = problem_of(spec, vehicle)
    time = np.arange(SAMPLES) * spec.period / SAMPLES
    random = [
        condition_number(problem.normal_matrix(sized(spec, vehicle, seed)[0].evaluate(time))) for seed in range(20)
    ]
    assert found.condition < np.median(random)
    assert found.condition == pytest.approx(condition_number(problem.normal_matrix(found.series.evaluate(time))))


@pytest.fixture(scope="module")
def prototype() -> VehicleDescription:
    return load_vehicle("prototype")


@pytest.fixture(scope="module")
def optimised(prototype: VehicleDescription) -> Excitation:
    return optimise(problem_of(EXCITATIONS[Step.STRAIGHT], prototype), np.random.default_rng(0))


def test_optimised_excitation_is_better_than_random_and_than_that_of_the_paper(
    optimised: Excitation, prototype: VehicleDescription
) -> None:
    assert_better_than_random(EXCITATIONS[Step.STRAIGHT], optimised, prototype)
    assert optimised.condition < 8.0
    assert_within_limits(EXCITATIONS[Step.STRAIGHT], optimised.series, prototype)


@pytest.mark.slow
@steps
@pytest.mark.parametrize("seed", [1, 2])
def test_every_optimised_excitation_is_well_conditioned_and_keeps_the_limits(
    step: Step, seed: int, vehicle: VehicleDescription
) -> None:
    spec = EXCITATIONS[step]
    found = optimise(problem_of(spec, vehicle), np.random.default_rng(seed))
    assert_better_than_random(spec, found, vehicle)
    assert_within_limits(spec, found.series, vehicle)
    assert found.condition < 8.0


@pytest.mark.slow
def test_one_seed_gives_one_excitation(optimised: Excitation, prototype: VehicleDescription) -> None:
    again = optimise(problem_of(EXCITATIONS[Step.STRAIGHT], prototype), np.random.default_rng(0))
    np.testing.assert_array_equal(again.series.cosine, optimised.series.cosine)
    np.testing.assert_array_equal(again.series.sine, optimised.series.sine)


def test_the_axis_of_a_step_is_what_its_motors_feel(vehicle: VehicleDescription) -> None:
    """Inertia, friction and levers of every step by the formulas of a textbook."""
    p, g = vehicle.prior, vehicle.geometry
    lever = np.hypot(g.wheelbase, g.track_width) / 2 + g.wheel_offset
    yaw = p["C_ch"] + p["C_l"] + p["C_r"]

    def geared(base: tuple[float, float, float], wheels: int, ratio: float) -> Callable[[], tuple[float, ...]]:
        inertia, viscous, coulomb = base
        return lambda: (
            inertia + wheels * p["B_w"] * ratio**2,
            viscous + wheels * p["d_vw"] * ratio**2,
            coulomb + wheels * p["d_cw"] * ratio,
            1 / (wheels * ratio * g.gear_ratio),
            ratio,
        )

    expected = {
        Step.WHEEL_LIFTED: geared((0.0, 0.0, 0.0), 1, 1.0),
        Step.STEERING_LEFT: geared((p["C_l"], p["d_vl"], p["d_cl"]), 2, g.lever_ratio),
        Step.STEERING_RIGHT: geared((p["C_r"], p["d_vr"], p["d_cr"]), 2, g.lever_ratio),
        Step.STRAIGHT: geared((p["m_ch"], 0.0, 0.0), 4, 1 / g.wheel_radius),
        Step.LATERAL: geared((p["m_ch"], 0.0, 0.0), 4, 1 / g.wheel_radius),
        Step.ROTATION: geared((yaw, 0.0, 0.0), 4, lever / g.wheel_radius),
    }
    for step, formula in expected.items():
        axis = axis_of(EXCITATIONS[step], vehicle)
        found = (axis.inertia, axis.viscous, axis.coulomb, axis.motor_torque, axis.wheel_rate)
        np.testing.assert_allclose(found, formula(), rtol=1e-9, err_msg=str(step))
        free = axis.inertia if step is Step.WHEEL_LIFTED else axis.slipping_inertia
        wheels = {Step.WHEEL_LIFTED: 1, Step.STEERING_LEFT: 2, Step.STEERING_RIGHT: 2}.get(step, 4)
        assert free == pytest.approx(wheels * p["B_w"] * axis.wheel_rate**2)

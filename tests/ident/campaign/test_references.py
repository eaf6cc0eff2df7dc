from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.campaign.axis import axis_of
from ident.campaign.plan import Plan
from ident.campaign.reference import Reference, alignment_reference, smooth_step
from ident.campaign.steps import EXCITATIONS, PERIODS
from ident.plant import kinematics
from ident.plant.kinematics import detect_mode
from ident.plant.modes import Mode
from ident.records.record import Step
from ident.vehicle.description import VehicleDescription

Array = NDArray[np.float64]
References = dict[Step, Reference]
CYCLE = 0.002
excitation_steps = pytest.mark.parametrize("step", list(EXCITATIONS))


def derivative(values: Array) -> Array:
    return np.gradient(values, CYCLE, axis=0)


@excitation_steps
def test_an_excitation_step_starts_and_ends_at_rest_and_repeats_its_periods(references: References, step: Step) -> None:
    found = references[step]
    per_period = round(EXCITATIONS[step].period / CYCLE)
    counts = [int(np.sum(found.period == number)) for number in range(PERIODS)]
    assert counts == [per_period] * PERIODS
    for track in found.tracks.values():
        assert len(track.position) == len(track.velocity) == len(track.wheels) == len(found)
        for end in (0, -1):
            assert track.velocity[end] == 0.0
            assert track.position[end] == pytest.approx(track.position[0], abs=1e-9)
        for number in range(1, PERIODS):
            np.testing.assert_allclose(
                track.position[found.period == number], track.position[found.period == 0], atol=1e-9
            )
    np.testing.assert_allclose(found.feed_forward[[0, -1]], 0.0, atol=1e-9)
    assert found.duration == pytest.approx(len(found) * CYCLE)


@excitation_steps
def test_the_velocity_of_a_track_is_the_derivative_of_its_position(references: References, step: Step) -> None:
    for track in references[step].tracks.values():
        moving = np.abs(track.velocity).max()
        np.testing.assert_allclose(derivative(track.position), track.velocity, atol=2e-2 * max(moving, 1e-9))


@excitation_steps
def test_only_the_driven_coordinate_moves(plan: Plan, references: References, step: Step) -> None:
    spec, found = EXCITATIONS[step], references[step]
    moving = [name for name, track in found.tracks.items() if np.any(track.velocity != 0)]
    assert moving == ([spec.coordinate] if spec.mode is not None else list(found.tracks))
    start = spec.steering(plan.vehicle.geometry)
    if spec.mode not in (None, Mode.ALIGNMENT):
        held = [found.tracks["alpha_l"].position, found.tracks["alpha_r"].position]
        np.testing.assert_allclose(held, np.tile(start[:, None], len(found)))
        assert detect_mode(start, plan.vehicle.geometry) == spec.mode


@excitation_steps
def test_wheels_turn_by_their_column_of_the_motion_and_roll_the_vehicle_along_its_path(
    plan: Plan, references: References, step: Step
) -> None:
    """Odometry of what the tracks make the wheels do is the path that the reference promises."""
    if EXCITATIONS[step].mode is None:
        pytest.skip("wheels in the air drive no path")
    found, geometry = references[step], plan.vehicle.geometry
    wheels = np.sum([track.velocity[:, None] * track.wheels for track in found.tracks.values()], axis=0)
    alpha, alpha_rate = (
        np.stack([getattr(found.tracks[name], what) for name in ("alpha_l", "alpha_r")], axis=1)
        for what in ("position", "velocity")
    )
    twist = kinematics.odometry(alpha, alpha_rate, wheels, geometry)
    path = np.cumsum(twist * CYCLE, axis=0)
    np.testing.assert_allclose(path, found.path, atol=5e-3)


@excitation_steps
def test_feed_forward_is_inertia_and_friction_of_the_axis_shared_among_its_wheels(
    plan: Plan, references: References, step: Step
) -> None:
    """Power of the motors equals force times speed of the coordinate, by the lumped axis."""
    found, spec = references[step], EXCITATIONS[step]
    axis = axis_of(spec, plan.vehicle)
    name = spec.coordinate if spec.mode is not None else "beta_fl"
    track = found.tracks[name]
    acceleration = derivative(track.velocity)
    expected = axis.torque(track.velocity, acceleration) * track.velocity
    wheels = found.feed_forward if spec.mode is not None else found.feed_forward[:, :1]
    columns = track.wheels if spec.mode is not None else track.wheels[:, :1]
    power = plan.vehicle.geometry.gear_ratio * np.sum(wheels * columns, axis=1) * track.velocity
    inner = slice(600, -600)
    np.testing.assert_allclose(power[inner], expected[inner], atol=0.01 * np.abs(expected).max())


@pytest.fixture(scope="module")
def lane_change(references: References) -> Reference:
    return references[Step.LANE_CHANGE]


def test_a_lane_change_ends_parallel_and_shifted_by_what_was_asked(plan: Plan, lane_change: Reference) -> None:
    end = lane_change.path[-1]
    assert end[2] == pytest.approx(0.0, abs=1e-4)
    assert end[1] == pytest.approx(plan.manoeuvre.shift, rel=0.05)
    assert np.abs(lane_change.path[:, 2]).max() < math.radians(45)
    assert end[0] > 0


def test_a_lane_change_starts_and_ends_at_rest_with_wheels_ahead(lane_change: Reference) -> None:
    for name, track in lane_change.tracks.items():
        np.testing.assert_allclose(track.velocity[[0, -1]], 0.0, atol=1e-9)
        if name != "x":
            np.testing.assert_allclose(track.position[[0, -1]], 0.0, atol=1e-9)
    np.testing.assert_allclose(lane_change.feed_forward[[0, -1]], 0.0, atol=1e-9)


def test_a_lane_change_begins_and_ends_to_steer_without_a_jerk(lane_change: Reference) -> None:
    for name in ("alpha_l", "alpha_r"):
        velocity = lane_change.tracks[name].velocity
        assert np.abs(np.diff(velocity)).max() < 0.02 * np.abs(velocity).max()


def test_a_lane_change_keeps_the_axles_on_one_centre(plan: Plan, lane_change: Reference) -> None:
    geometry = plan.vehicle.geometry
    alpha = np.stack([lane_change.tracks[name].position for name in ("alpha_l", "alpha_r")], axis=1)
    assert np.all(detect_mode(alpha, geometry, 1e-12) == Mode.STEERED)
    assert np.abs(alpha).max() > 0.05, "it does steer"
    # The path curves as the steering says: tan(alpha_v) over l/2, read off the left angle.
    left = np.tan(alpha[:, 0])
    curvature = left / (geometry.wheelbase / 2 + geometry.track_width / 2 * left)
    moving = lane_change.tracks["x"].velocity > 0.1
    turned = np.gradient(lane_change.path[:, 2], CYCLE)[moving] / lane_change.tracks["x"].velocity[moving]
    np.testing.assert_allclose(turned, curvature[moving], atol=2e-3)


def test_a_lane_change_rolls_as_far_as_its_path_is_long(lane_change: Reference) -> None:
    arc = np.sum(np.hypot(*np.diff(lane_change.path[:, :2], axis=0).T))
    assert arc == pytest.approx(lane_change.tracks["x"].position[-1], rel=1e-4)


def test_a_lane_change_is_within_what_motors_and_floor_give(plan: Plan, lane_change: Reference) -> None:
    limits, geometry = plan.vehicle.limits, plan.vehicle.geometry
    torque = np.abs(lane_change.feed_forward).max()
    assert torque < limits.peak_torque
    grip = limits.floor_friction * plan.vehicle.prior["m_ch"] * 9.81 / 4
    assert torque * geometry.gear_ratio / geometry.wheel_radius < grip
    sideways = np.abs(np.gradient(lane_change.path[:, 2], CYCLE) * lane_change.tracks["x"].velocity)
    assert sideways.max() < limits.floor_friction * 9.81 / 2


@pytest.mark.parametrize("start", [(0.0, 0.0), (-1.5, 1.5), (0.4, -0.2), (1e-4, 0.0)])
@pytest.mark.parametrize("step", [Step.STRAIGHT, Step.ROTATION, Step.LATERAL, Step.LANE_CHANGE])
def test_an_alignment_turns_both_sides_smoothly_to_where_the_step_begins(
    plan: Plan, start: tuple[float, float], step: Step
) -> None:
    found = plan.alignment(np.array(start), step, plan.vehicle.prior)
    target = plan.posture(step)
    low = np.minimum(start, target) - 0.1
    high = np.maximum(start, target) + 0.1
    for side, name in enumerate(("alpha_l", "alpha_r")):
        track = found.tracks[name]
        assert track.position[0] == pytest.approx(start[side], abs=1e-12)
        assert track.position[-1] == pytest.approx(target[side], abs=1e-12)
        np.testing.assert_allclose(track.velocity[[0, -1]], 0.0, atol=1e-12)
        assert np.all((track.position >= low[side]) & (track.position <= high[side]))
        assert np.abs(track.position).max() <= plan.vehicle.geometry.steering_limit
        np.testing.assert_allclose(derivative(track.position), track.velocity, atol=5e-3)
    assert np.abs(found.feed_forward).max() <= plan.vehicle.limits.peak_torque
    assert set(found.period.tolist()) == {-1}
    assert "x" not in found.tracks, "at rest"


def test_an_alignment_arrives_slowly_and_in_the_direction_of_its_stroke(vehicle: VehicleDescription) -> None:
    found = alignment_reference(np.zeros(2), np.array([0.8, -0.8]), vehicle, vehicle.prior, CYCLE)
    for name, sign in (("alpha_l", 1), ("alpha_r", -1)):
        assert np.all(sign * found.tracks[name].velocity >= -1e-12)
        last = np.abs(found.tracks[name].position - sign * 0.8) < 0.04
        assert np.abs(found.tracks[name].velocity[last]).max() < 0.1


def test_a_smooth_step_begins_and_ends_with_speed_and_acceleration_zero() -> None:
    value, rate, curvature = smooth_step(np.array([-1.0, 0.0, 0.5, 1.0, 2.0]))
    np.testing.assert_allclose(value, [0, 0, 0.5, 1, 1])
    np.testing.assert_allclose(rate, [0, 0, 15 / 8, 0, 0])
    np.testing.assert_allclose(curvature, 0, atol=1e-12)
    progress = np.linspace(0, 1, 2001)
    value, rate, curvature = smooth_step(progress)
    np.testing.assert_allclose(np.gradient(value, progress)[1:-1], rate[1:-1], atol=1e-5)
    np.testing.assert_allclose(np.gradient(rate, progress)[1:-1], curvature[1:-1], atol=1e-4)

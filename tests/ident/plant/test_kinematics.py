from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from ident.plant import kinematics
from ident.plant.kinematics import virtual_steering
from ident.plant.modes import Mode
from ident.vehicle.geometry import Geometry

Array = NDArray[np.float64]

property_of = settings(max_examples=40, deadline=None, derandomize=True)
angle = st.floats(-1.5, 1.5)
rate = st.floats(-3.0, 3.0)
share = st.floats(-0.95, 0.95)
modes = pytest.mark.parametrize("mode", list(Mode))


def angles_of(mode: Mode, free: tuple[float, float], virtual: float, geometry: Geometry) -> Array:
    """Steering angles (1, 2) that belong to a mode; `virtual` is a share of the largest virtual angle."""
    return {
        Mode.ALIGNMENT: np.array([free]),
        Mode.STEERED: kinematics.steering_from_virtual(virtual * geometry.rotation_angle, geometry),
        Mode.LATERAL: np.array([[-math.pi / 2, math.pi / 2]]),
        Mode.ROTATION: np.array([[-geometry.rotation_angle, geometry.rotation_angle]]),
    }[mode]


@property_of
@given(state=st.lists(angle, min_size=9, max_size=9), rates=st.lists(rate, min_size=9, max_size=9))
def test_the_constraints_are_the_slip_velocities_of_rigid_wheels_in_space(
    slip_of: Callable[[Array, Array], Array], geometry: Geometry, state: list[float], rates: list[float]
) -> None:
    q, velocity = np.array(state), np.array(rates)
    heading = np.eye(9)
    heading[:2, :2] = [[np.cos(q[2]), np.sin(q[2])], [-np.sin(q[2]), np.cos(q[2])]]  # world to chassis frame
    predicted = kinematics.constraint_matrix(q[3:5], geometry)[0] @ heading @ velocity
    np.testing.assert_allclose(predicted, slip_of(q, velocity), atol=2e-8)


@modes
@property_of
@given(free=st.tuples(angle, angle), virtual=share)
def test_no_wheel_slips_in_any_mode(mode: Mode, geometry: Geometry, free: tuple[float, float], virtual: float) -> None:
    alpha = angles_of(mode, free, virtual, geometry)
    A = kinematics.constraint_matrix(alpha, geometry)[0]
    H = kinematics.complement(mode, alpha, geometry)[0]
    np.testing.assert_allclose(A @ H, 0.0, atol=1e-11 * np.abs(H).max())
    assert np.linalg.matrix_rank(H) == len(kinematics.GENERALIZED_VELOCITIES[mode])


@modes
def test_only_the_rank_of_the_constraints_depends_on_the_mode(mode: Mode, geometry: Geometry) -> None:
    """Two steering rates are always free; one motion of the chassis is, once the wheel axles meet in a point."""
    alpha = angles_of(mode, (0.3, -0.7), 0.5, geometry)
    A = kinematics.constraint_matrix(alpha, geometry)[0]
    free = 9 - np.linalg.matrix_rank(A, tol=1e-9)
    assert free == (2 if mode is Mode.ALIGNMENT else 3)
    motions = np.hstack(
        [kinematics.complement(Mode.ALIGNMENT, alpha, geometry)[0], kinematics.complement(mode, alpha, geometry)[0]]
    )
    assert np.linalg.matrix_rank(motions) == free


@modes
@property_of
@given(free=st.tuples(angle, angle), virtual=share, rates=st.tuples(rate, rate))
def test_the_rate_of_the_complement_is_its_derivative_along_the_motion(
    mode: Mode, geometry: Geometry, free: tuple[float, float], virtual: float, rates: tuple[float, float]
) -> None:
    alpha, alpha_rate = angles_of(mode, free, 0.8 * virtual, geometry), np.array([rates])
    h = 1e-6
    ahead = kinematics.complement(mode, alpha + h * alpha_rate, geometry)
    behind = kinematics.complement(mode, alpha - h * alpha_rate, geometry)
    expected = (ahead - behind) / (2 * h)
    found = kinematics.complement_rate(mode, alpha, alpha_rate, geometry)
    np.testing.assert_allclose(found, expected, atol=1e-6 * max(1.0, np.abs(expected).max()))


@modes
@property_of
@given(free=st.tuples(angle, angle), virtual=share, velocity=st.tuples(rate, rate))
def test_odometry_recovers_the_twist_that_turned_the_wheels(
    mode: Mode, geometry: Geometry, free: tuple[float, float], virtual: float, velocity: tuple[float, float]
) -> None:
    alpha = angles_of(mode, free, virtual, geometry)
    H = kinematics.complement(mode, alpha, geometry)[0]
    rates = H @ np.array(velocity[: H.shape[1]])
    twist = kinematics.odometry(alpha, rates[None, 3:5], rates[None, 5:], geometry)[0]
    np.testing.assert_allclose(twist, rates[:3], atol=1e-10 * max(1.0, np.abs(rates).max()))


@property_of
@given(wheels=st.tuples(rate, rate, rate, rate), angles=st.tuples(angle, angle))
def test_odometry_of_slipping_wheels_is_the_twist_of_least_slip(
    geometry: Geometry, wheels: tuple[float, ...], angles: tuple[float, float]
) -> None:
    rates = np.concatenate([[0.0, 0.0, 0.0], [0.4, -0.2], wheels])
    A = kinematics.constraint_matrix(np.array(angles), geometry)[0]
    expected, *_ = np.linalg.lstsq(A[:, :3], -A @ rates, rcond=None)
    found = kinematics.odometry(np.array(angles), rates[3:5], rates[5:], geometry)[0]
    np.testing.assert_allclose(found, expected, atol=1e-9)


@property_of
@given(virtual=share.filter(lambda value: abs(value) > 0.02))
def test_the_axles_of_a_steered_vehicle_meet_in_one_point_beside_its_centre(geometry: Geometry, virtual: float) -> None:
    alpha_v = virtual * geometry.rotation_angle
    left, right = kinematics.steering_from_virtual(alpha_v, geometry)[0]
    half_l, half_b = geometry.wheelbase / 2, geometry.track_width / 2
    corners = np.array([[half_l, half_b], [-half_l, half_b], [half_l, -half_b], [-half_l, -half_b]])
    headings = np.array([left, -left, right, -right])
    tangents = np.stack([np.cos(headings), np.sin(headings)], axis=1)
    # A point p lies on the axle of a wheel when (p - corner) is normal to the wheel's heading.
    centre, *_ = np.linalg.lstsq(tangents, np.sum(tangents * corners, axis=1), rcond=None)
    distances = np.sum(tangents * (centre - corners), axis=1)
    np.testing.assert_allclose(distances, 0.0, atol=1e-9 * max(1.0, abs(centre[1])))
    np.testing.assert_allclose(centre, [0.0, half_l / math.tan(alpha_v)], rtol=1e-6, atol=1e-6)


@property_of
@given(virtual=share)
def test_the_virtual_angle_of_the_real_angles_is_the_one_they_came_from(geometry: Geometry, virtual: float) -> None:
    alpha_v = virtual * geometry.rotation_angle
    alpha = kinematics.steering_from_virtual(alpha_v, geometry)
    assert virtual_steering(alpha, geometry)[0] == pytest.approx(alpha_v, abs=1e-9)


@property_of
@given(virtual=share, steering=rate, speed=rate)
def test_steered_motion_stays_on_the_curve_of_common_centres(
    geometry: Geometry, virtual: float, steering: float, speed: float
) -> None:
    alpha_v, h = 0.8 * virtual * geometry.rotation_angle, 1e-6
    alpha = kinematics.steering_from_virtual(alpha_v, geometry)
    rates = kinematics.complement(Mode.STEERED, alpha, geometry)[0] @ [steering, speed]
    around = kinematics.steering_from_virtual(np.array([alpha_v - h, alpha_v + h]), geometry)
    np.testing.assert_allclose(rates[3:5], steering * (around[1] - around[0]) / (2 * h), atol=1e-7)
    yaw = speed * math.tan(alpha_v) / (geometry.wheelbase / 2)
    np.testing.assert_allclose(rates[:3], [speed, 0.0, yaw], atol=1e-9)


def test_steering_at_standstill_rolls_front_and_rear_wheel_against_each_other(geometry: Geometry) -> None:
    H = kinematics.complement(Mode.ALIGNMENT, np.array([0.3, -0.4]), geometry)[0]
    ratio = geometry.lever_ratio
    np.testing.assert_allclose(H[5:, 0], [-ratio, ratio, 0, 0], atol=1e-12)
    np.testing.assert_allclose(H[5:, 1], [0, 0, ratio, -ratio], atol=1e-12)


def test_the_vehicle_rolls_forward_left_and_counterclockwise_as_its_signs_say(geometry: Geometry) -> None:
    """Forward: all wheels positive. Left, with front wheels at (-90, +90) deg: each pair pushes by its heading.

    Counterclockwise, with the front wheels turned outwards in front: every contact moves on a circle.
    """
    ahead = kinematics.complement(Mode.STEERED, np.zeros(2), geometry)[0, 5:, 1]
    np.testing.assert_allclose(ahead, 1 / geometry.wheel_radius)
    across = kinematics.complement(Mode.LATERAL, np.zeros(2), geometry)[0, 5:, 0]
    np.testing.assert_allclose(across, np.array([-1, 1, 1, -1]) / geometry.wheel_radius, atol=1e-12)
    turning = kinematics.complement(Mode.ROTATION, np.zeros(2), geometry)[0, 5:, 0]
    speed = geometry.rotation_lever / geometry.wheel_radius
    np.testing.assert_allclose(turning, np.array([-1, -1, 1, 1]) * speed, atol=1e-12)


@pytest.mark.parametrize(("speed", "turn"), [(1.0, 0.5), (-0.7, 0.3), (0.4, -2.0)])
def test_a_constant_twist_drives_a_circle_back_to_its_start(speed: float, turn: float) -> None:
    samples = 4001
    sample_time = 2 * math.pi / abs(turn) / (samples - 1)
    pose = kinematics.integrate_pose(np.tile([speed, 0.0, turn], (samples, 1)), sample_time)
    radius = speed / turn
    np.testing.assert_allclose(pose[-1, :2], 0.0, atol=1e-9)
    np.testing.assert_allclose(np.hypot(pose[:, 0], pose[:, 1] - radius), abs(radius), rtol=2e-6)
    np.testing.assert_allclose(pose[-1, 2], 2 * math.pi * np.sign(turn))


def test_functions_of_many_samples_are_the_functions_of_each(geometry: Geometry) -> None:
    generator = np.random.default_rng(0)
    alpha, alpha_rate = generator.uniform(-1, 1, (2, 7, 2))
    for index in range(7):
        one = kinematics.constraint_matrix(alpha[index], geometry)[0]
        np.testing.assert_array_equal(kinematics.constraint_matrix(alpha, geometry)[index], one)
        rate_of_one = kinematics.complement_rate(Mode.STEERED, alpha[index], alpha_rate[index], geometry)[0]
        all_rates = kinematics.complement_rate(Mode.STEERED, alpha, alpha_rate, geometry)
        np.testing.assert_array_equal(all_rates[index], rate_of_one)


def test_no_samples_give_no_matrices(geometry: Geometry) -> None:
    assert kinematics.constraint_matrix(np.zeros((0, 2)), geometry).shape == (0, 8, 9)
    assert kinematics.odometry(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros((0, 4)), geometry).shape == (0, 3)

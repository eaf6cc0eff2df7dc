from __future__ import annotations

import math

import casadi as ca
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from ident.plant import symbolic
from ident.plant.kinematics import detect_mode, steering_from_virtual, virtual_steering
from ident.plant.modes import Mode
from ident.vehicle.geometry import Geometry

TOLERANCE = 0.02
property_of = settings(max_examples=100, deadline=None, derandomize=True)
unit = st.floats(-1.0, 1.0)


def icr_residual(alpha: np.ndarray, geometry: Geometry) -> float:
    """Size of the angular distance from the curve: the third condition is |f| - tolerance · gradient."""
    angles, tolerance = ca.SX.sym("alpha", 2), ca.SX.sym("tolerance")
    condition = symbolic.mode_distances(angles, tolerance)[2]
    function = ca.Function("f", [angles, symbolic.GEOMETRY, tolerance], [condition])
    at_zero, at_one = (float(function(alpha, geometry.as_vector(), each)) for each in (0.0, 1.0))
    return at_zero / (at_zero - at_one)


def rotation_angles(geometry: Geometry) -> np.ndarray:
    return np.array([-geometry.rotation_angle, geometry.rotation_angle])


def test_the_angles_of_equation_9_are_recognised(geometry: Geometry) -> None:
    angles = np.array([[0.0, 0.0], [-math.pi / 2, math.pi / 2], rotation_angles(geometry), [0.5, -0.5]])
    np.testing.assert_array_equal(
        detect_mode(angles, geometry), [Mode.STEERED, Mode.LATERAL, Mode.ROTATION, Mode.ALIGNMENT]
    )


def test_straight_ahead_is_steered_motion_without_curvature(geometry: Geometry) -> None:
    """(6) is infinity minus infinity there; the regular form is not."""
    assert icr_residual(np.zeros(2), geometry) == 0.0
    assert virtual_steering(np.zeros(2), geometry) == 0.0
    near = np.array([[0.003, 0.003], [1e-12, -1e-12], [-0.004, 0.004]])
    np.testing.assert_array_equal(detect_mode(near, geometry), Mode.STEERED)


@property_of
@given(share=st.floats(-0.9, 0.9), across=unit)
def test_steering_close_to_the_curve_of_common_centres_is_steered_motion(
    geometry: Geometry, share: float, across: float
) -> None:
    """Moved off the curve at right angles: inside the tolerance it is mode 2, outside it is not."""
    alpha_v = share * geometry.rotation_angle
    before, on_curve, after = steering_from_virtual(np.array([alpha_v - 1e-6, alpha_v, alpha_v + 1e-6]), geometry)
    tangent = (after - before) / np.linalg.norm(after - before)
    normal = np.array([-tangent[1], tangent[0]])
    inside, outside = (
        on_curve + 0.9 * TOLERANCE * across * normal,
        on_curve + np.sign(across) * 1.3 * TOLERANCE * normal,
    )
    assert detect_mode(inside, geometry, TOLERANCE) == Mode.STEERED
    assume(abs(across) > 0)
    assert detect_mode(outside, geometry, TOLERANCE) != Mode.STEERED


@property_of
@given(share=st.floats(-0.9, 0.9), across=unit)
def test_the_residual_of_the_curve_is_a_distance_in_radians(geometry: Geometry, share: float, across: float) -> None:
    around = steering_from_virtual(share * geometry.rotation_angle + np.array([-1e-6, 0.0, 1e-6]), geometry)
    tangent = (around[2] - around[0]) / np.linalg.norm(around[2] - around[0])
    moved = around[1] + 0.01 * across * np.array([-tangent[1], tangent[0]])
    assert abs(icr_residual(moved, geometry)) == pytest.approx(0.01 * abs(across), rel=0.1, abs=1e-9)


@pytest.mark.parametrize(("mode", "centre"), [(Mode.ROTATION, "rotation"), (Mode.LATERAL, "lateral")])
@property_of
@given(left=unit, right=unit)
def test_a_corner_mode_reaches_as_far_as_its_tolerance(
    mode: Mode, centre: str, geometry: Geometry, left: float, right: float
) -> None:
    angles = rotation_angles(geometry) if centre == "rotation" else np.array([-math.pi / 2, math.pi / 2])
    deviation = np.array([left, right])
    assert detect_mode(angles + 0.99 * TOLERANCE * deviation, geometry, TOLERANCE) == mode
    assume(np.abs(deviation).max() > 0.01)
    outside = deviation / np.abs(deviation).max()
    for distance in (1.01, 1.5, 3.0):
        found = detect_mode(angles + distance * TOLERANCE * outside, geometry, TOLERANCE)
        assert found == Mode.ALIGNMENT, "wheels turned for another mode, but not exactly, only steer"


def test_a_quarter_turn_to_the_same_side_is_no_lateral_mode(geometry: Geometry) -> None:
    """The front wheels point left, the coupled rear wheels right: nothing can roll."""
    for angles in ([math.pi / 2, -math.pi / 2], [math.pi / 2, math.pi / 2]):
        assert detect_mode(np.array(angles), geometry) == Mode.ALIGNMENT


def test_shapes_of_many_samples_are_kept(geometry: Geometry) -> None:
    assert detect_mode(np.zeros((3, 5, 2)), geometry).shape == (3, 5)

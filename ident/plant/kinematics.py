"""Kinematics as vectorised numpy functions, generated from the symbolic model."""

from __future__ import annotations

from functools import cache
from typing import Any, Final

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ident.plant import symbolic
from ident.plant.modes import MODE_TOLERANCE, Mode
from ident.plant.vectorised import Vectorised, count_of
from ident.vehicle.geometry import Geometry

Array = NDArray[np.float64]

MANY: Final = 64
"""Samples from which numpy, one operation at a time, is faster than CasADi, one sample at a time."""


def evaluate(function: Any, shape: tuple[int, ...], *arguments: Array) -> Array:
    """Evaluate a CasADi function for N samples at once.

    Args:
        function: one output; its last arguments may be constant over the samples.
        shape: shape of the output for one sample.
        arguments: (N, n) arrays, or (n,) for arguments constant over the samples.

    Returns:
        (N, *shape).
    """
    samples = count_of(arguments)
    if samples == 0:
        return np.zeros((0, *shape))
    if samples >= MANY and all(argument.ndim == 1 or len(argument) == samples for argument in arguments):
        return np.ascontiguousarray(_vectorised(function)(*arguments)).reshape(samples, *shape)
    columns = [argument.T if argument.ndim == 2 else argument for argument in arguments]
    flat = np.asarray(function(*columns))
    rows, width = (shape[0], shape[1]) if len(shape) == 2 else (shape[0], 1)
    stacked = flat.reshape(rows, samples, width).transpose(1, 0, 2)
    return np.ascontiguousarray(stacked).reshape(samples, *shape)


@cache
def _vectorised(function: Any) -> Vectorised:
    return Vectorised(function)


def samples_of(*values: ArrayLike) -> list[Array]:
    """Arguments as (N, n) arrays."""
    return [np.atleast_2d(np.asarray(value, dtype=float)) for value in values]


@cache
def _constraint_function() -> Any:
    alpha = ca.SX.sym("alpha", 2)
    return ca.Function("A", [alpha, symbolic.GEOMETRY], [symbolic.constraint_matrix(alpha)])


@cache
def _odometry_function() -> Any:
    alpha, steering, wheels = ca.SX.sym("alpha", 2), ca.SX.sym("alphad", 2), ca.SX.sym("betad", 4)
    twist = symbolic.odometry(alpha, steering, wheels)
    return ca.Function("odometry", [alpha, steering, wheels, symbolic.GEOMETRY], [ca.cse(twist)])


@cache
def _complement_function(mode: Mode) -> Any:
    alpha = ca.SX.sym("alpha", 2)
    return ca.Function("H", [alpha, symbolic.GEOMETRY], [ca.densify(symbolic.complement(mode, alpha))])


@cache
def _complement_rate_function(mode: Mode) -> Any:
    alpha, rates = ca.SX.sym("alpha", 2), ca.SX.sym("alphad", 2)
    expression = ca.densify(symbolic.complement_rate(mode, alpha, rates))
    return ca.Function("Hdot", [alpha, rates, symbolic.GEOMETRY], [expression])


@cache
def _steering_function() -> Any:
    alpha_v = ca.SX.sym("alpha_v")
    return ca.Function("f_ICR", [alpha_v, symbolic.GEOMETRY], [symbolic.steering_from_virtual(alpha_v)])


@cache
def _virtual_function() -> Any:
    alpha = ca.SX.sym("alpha", 2)
    return ca.Function("alpha_v", [alpha, symbolic.GEOMETRY], [symbolic.virtual_from_steering(alpha)])


@cache
def _mode_function() -> Any:
    alpha, tolerance = ca.SX.sym("alpha", 2), ca.SX.sym("tolerance")
    distances = symbolic.mode_distances(alpha, tolerance)
    return ca.Function("distances", [alpha, symbolic.GEOMETRY, tolerance], [ca.cse(distances)])


GENERALIZED_VELOCITIES = {
    Mode.ALIGNMENT: ("alpha_l", "alpha_r"),
    Mode.STEERED: ("alpha_v", "x"),
    Mode.LATERAL: ("y",),
    Mode.ROTATION: ("gamma",),
}
"""ṡ_k of (10)-(13) by coordinate."""


def constraint_matrix(alpha: ArrayLike, geometry: Geometry) -> Array:
    """A(α) of (2) for α (N, 2): (N, 8, 9), A q̇ = 0 when the wheels roll."""
    (angles,) = samples_of(alpha)
    return evaluate(_constraint_function(), (8, 9), angles, geometry.as_vector())


def odometry(alpha: ArrayLike, steering_rates: ArrayLike, wheel_rates: ArrayLike, geometry: Geometry) -> Array:
    """Twist in the chassis frame (N, 3) [m/s, m/s, rad/s] from α (N, 2), α̇ (N, 2), β̇ (N, 4) by (3)."""
    arguments = samples_of(alpha, steering_rates, wheel_rates)
    return evaluate(_odometry_function(), (3,), *arguments, geometry.as_vector())


def complement(mode: Mode, alpha: ArrayLike, geometry: Geometry) -> Array:
    """H_k(α) of (4) for α (N, 2): (N, 9, n_k)."""
    (angles,) = samples_of(alpha)
    width = len(GENERALIZED_VELOCITIES[mode])
    return evaluate(_complement_function(mode), (9, width), angles, geometry.as_vector())


def complement_rate(mode: Mode, alpha: ArrayLike, steering_rates: ArrayLike, geometry: Geometry) -> Array:
    """Ḣ_k of (20) for α, α̇ (N, 2): (N, 9, n_k)."""
    arguments = samples_of(alpha, steering_rates)
    width = len(GENERALIZED_VELOCITIES[mode])
    return evaluate(_complement_rate_function(mode), (9, width), *arguments, geometry.as_vector())


def steering_from_virtual(alpha_v: ArrayLike, geometry: Geometry) -> Array:
    """α (N, 2) of the virtual steering angle α_v (N,), equation (8), |α_v| < arctan(l/b)."""
    angles = np.atleast_1d(np.asarray(alpha_v, dtype=float))[:, None]
    return evaluate(_steering_function(), (2,), angles, geometry.as_vector())


def virtual_steering(alpha: ArrayLike, geometry: Geometry) -> Array:
    """α_v (N,) of (6) from α (N, 2): the mean curvature that both sides ask for [rad]."""
    (angles,) = samples_of(alpha)
    return evaluate(_virtual_function(), (1,), angles, geometry.as_vector())[:, 0]


def detect_mode(alpha: ArrayLike, geometry: Geometry, tolerance: float = MODE_TOLERANCE) -> NDArray[np.int64]:
    """k of (9) for steering angles α (..., 2); `tolerance` [rad] on each angle."""
    angles = np.asarray(alpha, dtype=float)
    inside = evaluate(_mode_function(), (4,), angles.reshape(-1, 2), geometry.as_vector(), np.array([tolerance])) < 0
    rotation, lateral, steered = inside[:, 0], inside[:, 1], inside[:, 2] & inside[:, 3]
    modes = [Mode.ROTATION, Mode.LATERAL, Mode.STEERED]
    return np.select([rotation, lateral, steered], modes, default=Mode.ALIGNMENT).reshape(angles.shape[:-1])


def integrate_pose(twist: ArrayLike, sample_time: float) -> Array:
    """World pose (N, 3) [m, m, rad] from chassis-frame twists (N, 3), trapezoidal, starting at the origin."""
    velocity = np.asarray(twist, dtype=float)
    heading = _cumulative(velocity[:, 2], sample_time)
    cos, sin = np.cos(heading), np.sin(heading)
    x = _cumulative(cos * velocity[:, 0] - sin * velocity[:, 1], sample_time)
    y = _cumulative(sin * velocity[:, 0] + cos * velocity[:, 1], sample_time)
    return np.stack([x, y, heading], axis=1)


def _cumulative(rate: Array, sample_time: float) -> Array:
    steps = np.concatenate([[0.0], (rate[1:] + rate[:-1]) * sample_time / 2])
    return np.cumsum(steps)

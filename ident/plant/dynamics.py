"""Dynamics as vectorised numpy functions, generated from the symbolic model: (19) and (21)."""

from __future__ import annotations

from functools import cache
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ident.plant import symbolic
from ident.plant.kinematics import (
    GENERALIZED_VELOCITIES,
    complement,
    complement_rate,
    evaluate,
    samples_of,
)
from ident.plant.modes import Mode
from ident.vehicle.geometry import Geometry
from ident.vehicle.parameters import COULOMB_EPSILON, PARAMETER_NAMES

Array = NDArray[np.float64]


@cache
def _regressor_function() -> Any:
    rates, accelerations = ca.SX.sym("qd", 9), ca.SX.sym("qdd", 9)
    theta = ca.densify(symbolic.regressor(rates, accelerations))
    return ca.Function("Theta", [rates, accelerations, symbolic.EPSILON], [theta])


@cache
def _projected_regressor_function(mode: Mode) -> Any:
    alpha, rates, accelerations = ca.SX.sym("alpha", 2), ca.SX.sym("qd", 9), ca.SX.sym("qdd", 9)
    projected = symbolic.complement(mode, alpha).T @ symbolic.regressor(rates, accelerations)
    inputs = [alpha, rates, accelerations, symbolic.GEOMETRY, symbolic.EPSILON]
    return ca.Function("HT_Theta", inputs, [ca.cse(ca.densify(projected))])


@cache
def _projected_input_function(mode: Mode) -> Any:
    alpha = ca.SX.sym("alpha", 2)
    projected = symbolic.complement(mode, alpha).T @ symbolic.input_matrix()
    return ca.Function("HT_B", [alpha, symbolic.GEOMETRY], [ca.cse(ca.densify(projected))])


def regressor(rates: ArrayLike, accelerations: ArrayLike, epsilon: float = COULOMB_EPSILON) -> Array:
    """Θ of (16) for q̇, q̈ (N, 9): (N, 9, 11)."""
    arguments = samples_of(rates, accelerations)
    shape = (9, len(PARAMETER_NAMES))
    return evaluate(_regressor_function(), shape, *arguments, np.array([epsilon]))


def projected_regressor(
    mode: Mode,
    alpha: ArrayLike,
    rates: ArrayLike,
    accelerations: ArrayLike,
    geometry: Geometry,
    epsilon: float = COULOMB_EPSILON,
) -> Array:
    """H_kᵀ Θ of (19) for α (N, 2), q̇, q̈ (N, 9): (N, n_k, 11), generalized forces per unit parameter."""
    arguments = samples_of(alpha, rates, accelerations)
    shape = (len(GENERALIZED_VELOCITIES[mode]), len(PARAMETER_NAMES))
    constants = (geometry.as_vector(), np.array([epsilon]))
    return evaluate(_projected_regressor_function(mode), shape, *arguments, *constants)


def projected_input(mode: Mode, alpha: ArrayLike, geometry: Geometry) -> Array:
    """H_kᵀ B of (19) for α (N, 2): (N, n_k, 4), generalized force per motor torque."""
    (angles,) = samples_of(alpha)
    shape = (len(GENERALIZED_VELOCITIES[mode]), 4)
    return evaluate(_projected_input_function(mode), shape, angles, geometry.as_vector())


def generalized_torques(mode: Mode, alpha: ArrayLike, motor_torques: ArrayLike, geometry: Geometry) -> Array:
    """H_kᵀ B u of (19) for α (N, 2), u (N, 4): (N, n_k) [Nm or N]."""
    matrix = projected_input(mode, alpha, geometry)
    return np.asarray(np.einsum("nij,nj->ni", matrix, np.asarray(motor_torques, dtype=float)))


def lift_velocities(
    mode: Mode, alpha: ArrayLike, velocities: ArrayLike, accelerations: ArrayLike, geometry: Geometry
) -> tuple[Array, Array]:
    """q̇, q̈ (N, 9) from ṡ_k, s̈_k (N, n_k) at α (N, 2), by (4) and (20)."""
    velocity, acceleration = samples_of(velocities, accelerations)
    H = complement(mode, alpha, geometry)
    rates = np.einsum("nij,nj->ni", H, velocity)
    H_rate = complement_rate(mode, alpha, rates[:, 3:5], geometry)
    lifted = np.einsum("nij,nj->ni", H_rate, velocity) + np.einsum("nij,nj->ni", H, acceleration)
    return rates, lifted


def feed_forward(
    mode: Mode,
    alpha: ArrayLike,
    velocities: ArrayLike,
    accelerations: ArrayLike,
    parameters: ArrayLike,
    geometry: Geometry,
    epsilon: float = COULOMB_EPSILON,
) -> Array:
    """Motor torques (N, 4) [Nm] for the desired α (N, 2), ṡ_k, s̈_k (N, n_k) and p (11,), equation (21)."""
    rates, lifted = lift_velocities(mode, alpha, velocities, accelerations, geometry)
    theta = projected_regressor(mode, alpha, rates, lifted, geometry, epsilon)
    wanted = theta @ np.asarray(parameters, dtype=float)
    inverse = np.linalg.pinv(projected_input(mode, alpha, geometry))
    return np.asarray(np.einsum("nij,nj->ni", inverse, wanted))

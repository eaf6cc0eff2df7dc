"""The reduced model (19) with effects, simulated forward under given motor torques; many runs side by side.

Friction of (16) is stiff near zero speed (eigenvalues of thousands a second in steering), so velocities are advanced by
the L-stable Rosenbrock method ROS2 (Verwer, Spee, Blom and Hundsdorfer 1999), angles by the trapezoidal rule.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ident.vehicle import symbolic
from ident.vehicle.effect_terms import (
    EffectTerm,
    State,
    added_forces,
    changed_parameters,
    on_radii,
    rolling_radii,
    shaft_torques,
)
from ident.vehicle.extended import ExtendedModel
from ident.vehicle.geometry import Geometry
from ident.vehicle.kinematics import GENERALIZED_VELOCITIES
from ident.vehicle.modes import Mode
from ident.vehicle.parameters import COULOMB_EPSILON, PARAMETER_NAMES
from ident.vehicle.symbolic import Expression
from ident.vehicle.vectorised import Vectorised

Array = NDArray[np.float64]

GAMMA: Final = 1 - 1 / math.sqrt(2)
"""Of ROS2; this root keeps the method L-stable with the smaller error."""

STEP: Final = 1e-3
"""Longest step of the integration [s]."""


@dataclass(frozen=True)
class Motion:
    """States of R runs.

    Attributes:
        heading: (R,) [rad].
        alpha: (R, 2) [rad].
        beta: (R, 4) [rad].
        velocities: ṡ_k (R, n_k).
    """

    heading: Array
    alpha: Array
    beta: Array
    velocities: Array


class Simulation:
    """One mode of a model.

    Args:
        model: parameters, and effects that are terms; effects with a memory of their own, except delays of drives,
            are left out.
        mode: k.
        geometry: of the vehicle.
    """

    def __init__(self, model: ExtendedModel, mode: Mode, geometry: Geometry) -> None:
        self._step = _step_function(mode, model.terms)
        self._delays = model.delays()
        self._constants = (model.parameters.values, geometry.as_vector(), np.array([COULOMB_EPSILON]))
        self._width = len(GENERALIZED_VELOCITIES[mode])

    def run(self, start: Motion, torques: Array, sample_time: float) -> Array:
        """Velocities ṡ_k (R, T, n_k) at the samples of the torques, the start first.

        Args:
            start: of R runs.
            torques: (R, T, 4) reported motor torques, linear between the samples [Nm].
            sample_time: of the torques [s].

        Raises:
            FloatingPointError: a state stops being finite.
        """
        parts = math.ceil(sample_time / STEP)
        late = _later(torques, self._delays, sample_time)
        state = np.hstack([start.heading[:, None], start.alpha, start.beta, start.velocities])
        found = [state[:, -self._width :]]
        for index in range(torques.shape[1] - 1):
            for part in range(parts):
                share = (part + 0.5) / parts
                now = (1 - share) * late[:, index] + share * late[:, index + 1]
                state = self._step(state, now, np.array([sample_time / parts]), *self._constants)[..., 0]
            if not np.isfinite(state).all():
                raise FloatingPointError(f"the simulation diverged after {index * sample_time:.3f} s")
            found.append(state[:, -self._width :])
        return np.stack(found, axis=1)


def _step_function(mode: Mode, terms: list[EffectTerm]) -> Vectorised:
    """(state, u, h, p, geometry, ε) -> state after a step h."""
    width = len(GENERALIZED_VELOCITIES[mode])
    x, u, h = ca.SX.sym("x", 7 + width), ca.SX.sym("u", 4), ca.SX.sym("h")
    p = ca.SX.sym("p", len(PARAMETER_NAMES))
    angles, velocity = x[:7], x[7:]
    change = _acceleration(mode, terms, angles, velocity, u, p)
    matrix = ca.SX.eye(width) - GAMMA * h * ca.jacobian(change, velocity)
    first = ca.solve(matrix, change)
    second = ca.solve(matrix, ca.substitute(change, velocity, velocity + h * first) - 2 * first)
    ahead = velocity + h * (1.5 * first + 0.5 * second)
    turning = _rates(mode, terms, angles, (velocity + ahead) / 2)[2:]
    state = ca.vertcat(angles + h * turning, ahead)
    inputs = [x, u, h, p, symbolic.GEOMETRY, symbolic.EPSILON]
    return Vectorised(ca.Function("step", inputs, [ca.cse(ca.densify(state))]))


def _complement(mode: Mode, terms: list[EffectTerm], angles: Expression) -> Expression:
    return on_radii(symbolic.complement(mode, angles[1:3]), rolling_radii(terms, angles[3:]))


def _rates(mode: Mode, terms: list[EffectTerm], angles: Expression, velocity: Expression) -> Expression:
    return _complement(mode, terms, angles) @ velocity


def _acceleration(
    mode: Mode, terms: list[EffectTerm], angles: Expression, velocity: Expression, u: Expression, p: Expression
) -> Expression:
    """s̈_k from (19): M s̈ = Hᵀ (B u′ - Θ p′ - f), M and the rest by q̈ = Ḣ ṡ + H s̈."""
    acceleration = ca.SX.sym("a", velocity.shape[0])
    H = _complement(mode, terms, angles)
    rates = H @ velocity
    accelerations = ca.jtimes(rates, angles, rates[2:]) + H @ acceleration
    state = State(angles[0], angles[1:3], angles[3:], rates, accelerations)
    inertial = symbolic.regressor(rates, accelerations) @ changed_parameters(terms, p)
    driving = symbolic.input_matrix() @ shaft_torques(terms, u, angles[3:])
    balance = H.T @ (driving - inertial - added_forces(terms, state, p))
    at_rest = ca.substitute(balance, acceleration, ca.SX.zeros(acceleration.shape[0]))
    return ca.solve(-ca.jacobian(balance, acceleration), at_rest)


def _later(torques: Array, delays: Array, sample_time: float) -> Array:
    if not delays.any():
        return torques
    time = np.arange(torques.shape[1]) * sample_time
    late = torques.copy()
    for wheel, delay in enumerate(delays):
        for run in range(len(torques)):
            late[run, :, wheel] = np.interp(time - delay, time, torques[run, :, wheel])
    return late

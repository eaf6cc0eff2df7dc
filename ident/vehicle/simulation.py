"""The reduced model (19) with effects, simulated forward under given motor torques; many runs side by side.

Friction of (16) is stiff near zero speed (eigenvalues of thousands a second in steering), and so are springs, so
velocities and twists are advanced by the L-stable Rosenbrock method ROS2 (Verwer, Spee, Blom and Hundsdorfer 1999),
angles by the trapezoidal rule.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ident.vehicle import symbolic
from ident.vehicle.extended import ExtendedModel
from ident.vehicle.flexible import FlexibleModel, Point
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

SPRING_STEP: Final = 2.5e-4
"""The same where something gives way: motor and wheel swing with some hundred radians a second."""

_ANGLES: Final = 7
"""γ, α, β."""


@dataclass(frozen=True)
class Motion:
    """States of R runs.

    Attributes:
        heading: (R,) [rad].
        alpha: (R, 2) true angles of the front units [rad].
        beta: (R, 4) of the wheels [rad].
        velocities: ṡ_k (R, n_k).
    """

    heading: Array
    alpha: Array
    beta: Array
    velocities: Array


@dataclass(frozen=True)
class Readings:
    """What encoders that are neither late nor misadjusted read of R runs.

    Attributes:
        steering_rates: α̇ of the front units (R, T, 2) [rad/s].
        wheel_rates: of the motors over the gear ratio (R, T, 4) [rad/s]; β̇ where nothing gives way.
    """

    steering_rates: Array
    wheel_rates: Array


@dataclass(frozen=True)
class Trajectory:
    """R runs of T samples, the start first.

    Attributes:
        velocities: ṡ_k (R, T, n_k).
        readings: of the encoders.
    """

    velocities: Array
    readings: Readings


class Simulation:
    """One mode of a model.

    A gear or coupling that gives way starts as the torques twist it, at rest in itself. In modes 2 to 4 the rear unit
    on a soft coupling turns its wheel, but the vehicle rolls as if it did not (`ident.vehicle.flexible`). Encoders
    that are late or misadjusted are for the reader of the trajectory; `slip` is left out: the wheels roll.

    Args:
        model: parameters and effects.
        mode: k.
        geometry: of the vehicle.
    """

    def __init__(self, model: ExtendedModel, mode: Mode, geometry: Geometry) -> None:
        flexible = FlexibleModel(mode, model.terms, model.springs)
        self._functions = _Functions(flexible)
        self._delays = model.drive_delays()
        self._longest = SPRING_STEP if model.springs else STEP
        self._constants = (model.parameters.values, geometry.as_vector(), np.array([COULOMB_EPSILON]))
        self._width = len(GENERALIZED_VELOCITIES[mode])
        self._twists = len(model.springs)

    def run(self, start: Motion, torques: Array, sample_time: float) -> Trajectory:
        """Motion of R runs under torques.

        Args:
            start: of R runs.
            torques: (R, T, 4) reported motor torques, linear between the samples [Nm].
            sample_time: of the torques [s].

        Raises:
            FloatingPointError: a state stops being finite.
        """
        late = _later(torques, self._delays, sample_time)
        twists, rates = self._resting(start, late, sample_time)
        state = np.hstack([start.heading[:, None], start.alpha, start.beta, twists, start.velocities, rates])
        return self._run(state, late, sample_time)

    def run_from_readings(self, start: Motion, readings: Readings, torques: Array, sample_time: float) -> Trajectory:
        """The same from what the encoders of the motors read at the start.

        Args:
            start: heading and angles, β of the motors; its velocities only where the twists do not depend on them.
            readings: at the start (R, 1, n).
            torques, sample_time: as for `run`.

        Raises:
            FloatingPointError: a state stops being finite.
        """
        late = _later(torques, self._delays, sample_time)
        twists, rates = self._resting(start, late, sample_time)
        beta = start.beta - self._functions.at_motors(twists)
        angles = np.hstack([start.heading[:, None], start.alpha, beta])
        matrix = self._functions.reading(angles, *self._constants[1:])
        read = np.hstack([readings.steering_rates[:, 0], readings.wheel_rates[:, 0]])
        read -= np.einsum("rij,rj->ri", matrix[:, :, self._width :], rates)
        velocities = np.einsum("rij,rj->ri", np.linalg.pinv(matrix[:, :, : self._width]), read)
        return self._run(np.hstack([angles, twists, velocities, rates]), late, sample_time)

    def _resting(self, start: Motion, torques: Array, sample_time: float) -> tuple[Array, Array]:
        """Twists and their rates (R, n) under the load of a motion in which nothing swings."""
        if not self._twists:
            return np.zeros((len(torques), 0)), np.zeros((len(torques), 0))
        state = np.hstack([start.heading[:, None], start.alpha, start.beta, start.velocities])
        change = (torques[:, 1] - torques[:, 0]) / sample_time
        found = self._functions.resting(state, torques[:, 0], change, *self._constants)[..., 0]
        return found[:, : self._twists], found[:, self._twists :]

    def _run(self, state: Array, torques: Array, sample_time: float) -> Trajectory:
        parts = math.ceil(sample_time / self._longest)
        states = [state]
        for index in range(torques.shape[1] - 1):
            for part in range(parts):
                share = (part + 0.5) / parts
                now = (1 - share) * torques[:, index] + share * torques[:, index + 1]
                state = self._functions.step(state, now, np.array([sample_time / parts]), *self._constants)[..., 0]
            if not np.isfinite(state).all():
                raise FloatingPointError(f"the simulation diverged after {index * sample_time:.3f} s")
            states.append(state)
        return self._trajectory(np.stack(states, axis=1))

    def _trajectory(self, states: Array) -> Trajectory:
        runs, samples, width = states.shape
        flat = states.reshape(-1, width)
        speeds = flat[:, _ANGLES + self._twists :]
        matrix = self._functions.reading(flat[:, :_ANGLES], *self._constants[1:])
        read = np.einsum("rij,rj->ri", matrix, speeds).reshape(runs, samples, 6)
        velocities = speeds[:, : self._width].reshape(runs, samples, -1)
        return Trajectory(velocities, Readings(read[..., :2], read[..., 2:]))


class _Functions:
    """The model as functions over many runs.

    Attributes:
        step: (state, u, h, p, geometry, ε) -> state after a step h; the state is γ, α, β, twists, ṡ, rates of twists.
        reading: (γ α β, geometry, ε) -> matrix (6, n_k + n) from velocities to what encoders read.
        resting: (γ α β ṡ, u, u̇, p, geometry, ε) -> twists and their rates.
    """

    def __init__(self, model: FlexibleModel) -> None:
        self._model = model
        parameters = ca.SX.sym("p", len(PARAMETER_NAMES))
        self.step = _vectorised(_step(model, parameters), parameters)
        angles = ca.SX.sym("angles", _ANGLES)
        self.reading = _vectorised(([angles], model.reading(angles)))
        self.resting = _vectorised(_resting(model, parameters), parameters)

    def at_motors(self, twists: Array) -> Array:
        """(R, 4) of the twists (R, n)."""
        return twists @ self._model.motor_columns().T


def _vectorised(function: tuple[list[Expression], Expression], *parameters: Expression) -> Vectorised:
    inputs, result = function
    constants = [*parameters, symbolic.GEOMETRY, symbolic.EPSILON]
    return Vectorised(ca.Function("f", [*inputs, *constants], [ca.cse(ca.densify(result))]))


def _step(model: FlexibleModel, p: Expression) -> tuple[list[Expression], Expression]:
    """One step of ROS2. A twist follows its rate, so its stages are eliminated: k_θ = f_θ + γ h k_ω."""
    count, width = model.twists, model.width
    x, u, h = ca.SX.sym("x", _ANGLES + count + width), ca.SX.sym("u", 4), ca.SX.sym("h")
    angles, twist, velocity = x[:_ANGLES], x[_ANGLES : _ANGLES + count], x[_ANGLES + count :]
    change = model.acceleration(Point(angles, twist, velocity), u, p)
    follows = ca.horzcat(ca.SX.zeros(count, width - count), ca.SX.eye(count))
    by_twist = GAMMA * h * ca.jacobian(change, twist)
    matrix = ca.SX.eye(width) - GAMMA * h * (ca.jacobian(change, velocity) + by_twist @ follows)

    def stage(turning: Expression, changing: Expression) -> tuple[Expression, Expression]:
        found = ca.solve(matrix, changing + by_twist @ turning)
        return turning + GAMMA * h * (follows @ found), found

    twisted, first = stage(follows @ velocity, change)
    moved = [twist + h * twisted, velocity + h * first]
    ahead = ca.substitute([change], [twist, velocity], moved)[0]
    twisted_on, second = stage(follows @ moved[1] - 2 * twisted, ahead - 2 * first)
    after = velocity + h * (1.5 * first + 0.5 * second)
    turning = model.rates(angles, (velocity + after) / 2)[2:9]
    return [x, u, h], ca.vertcat(angles + h * turning, twist + h * (1.5 * twisted + 0.5 * twisted_on), after)


def _resting(model: FlexibleModel, p: Expression) -> tuple[list[Expression], Expression]:
    plain = model.width - model.twists
    x, u, change = ca.SX.sym("x", _ANGLES + plain), ca.SX.sym("u", 4), ca.SX.sym("ud", 4)
    angles, velocity = x[:_ANGLES], x[_ANGLES:]
    twist, lag, acceleration = model.resting(angles, velocity, u, p)
    moving = ca.vertcat(model.rates(angles, ca.vertcat(velocity, ca.SX.zeros(model.twists)))[2:9], acceleration)
    rate = ca.jtimes(twist, x, moving) + ca.jtimes(twist, u, change)
    return [x, u, change], ca.vertcat(twist - lag * rate, rate)


def _later(torques: Array, delays: Array, sample_time: float) -> Array:
    if not delays.any():
        return torques
    time = np.arange(torques.shape[1]) * sample_time
    late = torques.copy()
    for wheel, delay in enumerate(delays):
        for run in range(len(torques)):
            late[run, :, wheel] = np.interp(time - delay, time, torques[run, :, wheel])
    return late

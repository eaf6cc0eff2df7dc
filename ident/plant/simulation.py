"""The reduced model (19) with effects, simulated forward under given motor torques; many runs side by side.

Friction of (16) is stiff near zero speed (eigenvalues of thousands a second in steering), and so are springs, so
velocities and twists are advanced by the L-stable Rosenbrock method ROS2 (Verwer, Spee, Blom and Hundsdorfer 1999),
angles by the trapezoidal rule.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ident.plant import symbolic
from ident.plant.bristles import bristles_of
from ident.plant.kinematics import GENERALIZED_VELOCITIES
from ident.plant.lags import late_series
from ident.plant.modes import Mode
from ident.plant.places import DRIVES
from ident.plant.rolling import Point, RollingModel
from ident.plant.symbolic import Expression
from ident.plant.terms import Term, delay_at, lag_at
from ident.plant.transmissions import springs_of
from ident.plant.vectorised import Vectorised
from ident.vehicle.geometry import Geometry
from ident.vehicle.parameters import COULOMB_EPSILON, PARAMETER_NAMES

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
        bent: how far the bristles of joints are bent (R, m), in the order of `Simulation.bristles`; None: not at all.
    """

    heading: Array
    alpha: Array
    beta: Array
    velocities: Array
    bent: Array | None = None


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
    on a soft coupling turns its wheel, but the vehicle rolls as if it did not (`ident.plant.rolling`). Encoders
    that are late or misadjusted are for the reader of the trajectory; `slip` is left out: the wheels roll.

    Args:
        parameters: p (11,).
        terms: additions with numbers.
        mode: k.
        geometry: of the vehicle.

    Attributes:
        bristles: joints whose friction bends bristles, with the angle θ of each [rad].
    """

    def __init__(self, parameters: Array, terms: Sequence[Term], mode: Mode, geometry: Geometry) -> None:
        springs = springs_of(terms)
        self._functions = _Functions(RollingModel(mode, terms, springs))
        self.bristles = {joint: float(angle) for joint, angle in bristles_of(terms).items()}
        self._delays, self._lags = (
            np.array([float(late_at(terms, drive)) for drive in DRIVES]) for late_at in (delay_at, lag_at)
        )
        self._longest = SPRING_STEP if springs else STEP
        self._constants = (parameters, geometry.as_vector(), np.array([COULOMB_EPSILON]))
        self._width = len(GENERALIZED_VELOCITIES[mode])
        self._twists = len(springs)

    def run(self, start: Motion, torques: Array, sample_time: float, elapsed: float = 0.0) -> Trajectory:
        """Motion of R runs under torques.

        Args:
            start: of R runs.
            torques: (R, T, 4) reported motor torques, linear between the samples [Nm].
            sample_time: of the torques [s].
            elapsed: time since the start of the campaign at which the runs start [s].

        Raises:
            FloatingPointError: a state stops being finite.
        """
        late = late_series(torques, self._delays, self._lags, sample_time)
        bent = self._bent(start)
        twists, rates = self._resting(start, bent, late, sample_time, elapsed)
        state = np.hstack([start.heading[:, None], start.alpha, start.beta, twists, start.velocities, rates, bent])
        return self._run(state, late, sample_time, elapsed)

    def run_from_readings(
        self, start: Motion, readings: Readings, torques: Array, sample_time: float, elapsed: float = 0.0
    ) -> Trajectory:
        """The same from what the encoders of the motors read at the start.

        Args:
            start: heading and angles, β of the motors; its velocities only where the twists do not depend on them.
            readings: at the start (R, 1, n).
            torques, sample_time, elapsed: as for `run`.

        Raises:
            FloatingPointError: a state stops being finite.
        """
        late = late_series(torques, self._delays, self._lags, sample_time)
        bent = self._bent(start)
        twists, rates = self._resting(start, bent, late, sample_time, elapsed)
        beta = start.beta - self._functions.at_motors(twists)
        angles = np.hstack([start.heading[:, None], start.alpha, beta])
        matrix = self._functions.reading(angles, *self._constants[1:])
        read = np.hstack([readings.steering_rates[:, 0], readings.wheel_rates[:, 0]])
        read -= np.einsum("rij,rj->ri", matrix[:, :, self._width :], rates)
        velocities = np.einsum("rij,rj->ri", np.linalg.pinv(matrix[:, :, : self._width]), read)
        return self._run(np.hstack([angles, twists, velocities, rates, bent]), late, sample_time, elapsed)

    def _bent(self, start: Motion) -> Array:
        return np.zeros((len(start.heading), len(self.bristles))) if start.bent is None else start.bent

    def _resting(
        self, start: Motion, bent: Array, torques: Array, sample_time: float, elapsed: float
    ) -> tuple[Array, Array]:
        """Twists and their rates (R, n) under the load of a motion in which nothing swings."""
        if not self._twists:
            return np.zeros((len(torques), 0)), np.zeros((len(torques), 0))
        state = np.hstack([start.heading[:, None], start.alpha, start.beta, start.velocities])
        change = (torques[:, 1] - torques[:, 0]) / sample_time
        now = torques[:, 0], change, np.array([elapsed])
        found = self._functions.resting(state, bent, *now, *self._constants)[..., 0]
        return found[:, : self._twists], found[:, self._twists :]

    def _run(self, state: Array, torques: Array, sample_time: float, elapsed: float) -> Trajectory:
        parts = math.ceil(sample_time / self._longest)
        share = (np.arange(parts) + 0.5) / parts
        before, after = torques[:, :-1, None], torques[:, 1:, None]
        now = (1 - share[:, None]) * before + share[:, None] * after
        time = elapsed + (np.arange(now.shape[1])[:, None] + share) * sample_time
        states = self._functions.steps(state, now, time, sample_time / parts, self._constants)
        lost = ~np.isfinite(states).all(axis=(0, 2))
        if lost.any():
            raise FloatingPointError(f"the simulation diverged after {int(lost.argmax()) * sample_time:.3f} s")
        return self._trajectory(np.concatenate([state[:, None], states], axis=1))

    def _trajectory(self, states: Array) -> Trajectory:
        runs, samples, width = states.shape
        flat = states.reshape(-1, width)
        first = _ANGLES + self._twists
        speeds = flat[:, first : first + self._width + self._twists]
        matrix = self._functions.reading(flat[:, :_ANGLES], *self._constants[1:])
        read = np.einsum("rij,rj->ri", matrix, speeds).reshape(runs, samples, 6)
        velocities = speeds[:, : self._width].reshape(runs, samples, -1)
        return Trajectory(velocities, Readings(read[..., :2], read[..., 2:]))


class _Functions:
    """The model as functions over many runs.

    Attributes:
        reading: (γ α β, geometry, ε) -> matrix (6, n_k + n) from velocities to what encoders read.
        resting: (γ α β ṡ, z, u, u̇, t, p, geometry, ε) -> twists and their rates.
    """

    def __init__(self, model: RollingModel) -> None:
        self._model = model
        parameters = ca.SX.sym("p", len(PARAMETER_NAMES))
        # One step after the other of few runs: CasADi's own virtual machine is faster than a numpy call an instruction.
        self._step = _function(_step(model, parameters), parameters)
        angles = ca.SX.sym("angles", _ANGLES)
        self.reading = _vectorised(([angles], model.reading(angles)))
        self.resting = _vectorised(_resting(model, parameters), parameters)

    def steps(self, state: Array, torques: Array, time: Array, step: float, constants: Sequence[Array]) -> Array:
        """States (R, T, n) after each of T samples of S steps; a state is γ, α, β, twists, ṡ, rates of the twists, z.

        Args:
            state: at the start (R, n).
            torques: in the middle of every step (R, T, S, 4) [Nm].
            time: the same instants (T, S) [s].
            step: [s].
            constants: p, geometry and ε.
        """
        runs, samples, parts, _ = torques.shape
        if not samples:
            return np.empty((runs, 0, state.shape[1]))
        inputs = torques.transpose(3, 1, 2, 0).reshape(4, -1)
        instants = np.repeat(time.reshape(1, -1), runs, axis=1)
        found = self._step.map(runs).mapaccum(samples * parts)(state.T, inputs, step, instants, *constants)
        every = np.asarray(found).T.reshape(samples, parts, runs, -1)
        return np.ascontiguousarray(every[:, -1].transpose(1, 0, 2))

    def at_motors(self, twists: Array) -> Array:
        """(R, 4) of the twists (R, n)."""
        return twists @ self._model.motor_columns().T


def _vectorised(function: tuple[list[Expression], Expression], *parameters: Expression) -> Vectorised:
    return Vectorised(_function(function, *parameters))


def _function(function: tuple[list[Expression], Expression], *parameters: Expression) -> Any:
    inputs, result = function
    constants = [*parameters, symbolic.GEOMETRY, symbolic.EPSILON]
    return ca.Function("f", [*inputs, *constants], [ca.cse(ca.densify(result))])


def _step(model: RollingModel, p: Expression) -> tuple[list[Expression], Expression]:
    """One step of ROS2. A twist follows its rate, so its stages are eliminated: k_θ = f_θ + γ h k_ω."""
    count, width, start = model.twists, model.width, _ANGLES + model.twists
    x, u = ca.SX.sym("x", start + width + len(model.bristles)), ca.SX.sym("u", 4)
    h, elapsed = ca.SX.sym("h"), ca.SX.sym("t")
    angles, twist, velocity, bent = x[:_ANGLES], x[_ANGLES:start], x[start : start + width], x[start + width :]
    point = Point(angles, twist, velocity, elapsed, bent)
    change = model.acceleration(replace(point, bent=model.bent_on(point, h / 2)), u, p)
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
    moving = replace(point, velocity=(velocity + after) / 2)
    turning = model.rates(angles, moving.velocity)[2:9]
    twist_after = twist + h * (1.5 * twisted + 0.5 * twisted_on)
    return [x, u, h, elapsed], ca.vertcat(angles + h * turning, twist_after, after, model.bent_on(moving, h))


def _resting(model: RollingModel, p: Expression) -> tuple[list[Expression], Expression]:
    plain = model.width - model.twists
    x, u, change = ca.SX.sym("x", _ANGLES + plain), ca.SX.sym("u", 4), ca.SX.sym("ud", 4)
    bent = ca.SX.sym("z", len(model.bristles))
    angles, velocity = x[:_ANGLES], x[_ANGLES:]
    still, elapsed = ca.SX.zeros(model.twists), ca.SX.sym("t")
    point = Point(angles, still, ca.vertcat(velocity, still), elapsed, bent)
    twist, lag, acceleration = model.resting(point, u, p)
    moving = ca.vertcat(model.rates(angles, point.velocity)[2:9], acceleration)
    rate = ca.jtimes(twist, x, moving) + ca.jtimes(twist, u, change)
    return [x, bent, u, change, elapsed], ca.vertcat(twist - lag * rate, rate)

"""The motor torques that a vehicle with effects needs for a motion: (21), and what the effects ask for beyond."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ident.effects.extended import ExtendedModel
from ident.estimate.filters import differentiate, second_derivative, zero_phase
from ident.plant import symbolic
from ident.plant.bristles import all_bent_along, bristles_of
from ident.plant.kinematics import GENERALIZED_VELOCITIES
from ident.plant.modes import Mode
from ident.plant.springs import MOTOR_SHARE, resting_twist, stiffness_of
from ident.plant.symbolic import Expression
from ident.plant.terms import (
    State,
    Term,
    added_forces,
    changed_parameters,
    on_radii,
    rolling_radii,
    shaft_torques,
)
from ident.plant.transmissions import Spring, springs_of
from ident.plant.vectorised import Vectorised
from ident.vehicle.geometry import Geometry
from ident.vehicle.parameters import COULOMB_EPSILON, PARAMETER_NAMES

Array = NDArray[np.float64]

TWIST_CUTOFF: Final = 150.0
"""Of the zero-phase filter on the twists that motors are asked for [rad/s]: no motor jumps from flank to flank."""


LOAD_ROUNDS: Final = 4
"""Of friction that depends on the torque which it asks for: at a tenth of the load 10⁻⁴ of it is left."""


@dataclass(frozen=True)
class Course:
    """A motion in one mode.

    Attributes:
        mode: k.
        heading: (N,) [rad].
        alpha: (N, 2) [rad].
        beta: (N, 4) [rad].
        velocities, accelerations: ṡ_k, s̈_k (N, n_k).
        elapsed: time since the start of the campaign (N,) [s].
    """

    mode: Mode
    heading: Array
    alpha: Array
    beta: Array
    velocities: Array
    accelerations: Array
    elapsed: Array


@dataclass(frozen=True)
class Demand:
    """What a motion asks of the motors.

    Attributes:
        torques: that the drives are to report (N, 4) [Nm].
        twists: of the motors over their wheels, at the wheels (N, 4) [rad].
    """

    torques: Array
    twists: Array


def feed_forward(model: ExtendedModel, course: Course, plain: Array, geometry: Geometry, sample_time: float) -> Demand:
    """Motor torques for a motion of a vehicle with effects.

    What the effects ask for at a wheel or a steering side is given there, the rest by the pseudoinverse as in (21).
    Motors behind gears that give way turn ahead of their wheels by compliance times load and half the play, as fast
    as TWIST_CUTOFF lets them; drives that are late are asked earlier, those that follow are asked for more while it
    rises. Bristles are straight where the motion begins. No torque makes up for a coupling of the steering
    that gives way (the inertia of its rear unit asks for less than a thousandth of what the steering needs), nor for
    `slip`; steering encoders are the controller's business.

    Args:
        model: with its effects.
        course: desired motion.
        plain: torques (N, 4) that the plain model with the same parameters gives, however distributed.
        geometry: of the vehicle.
        sample_time: of the course [s].
    """
    at_wheels = _wheels_function(course.mode, model.terms)
    found = at_wheels(
        course.heading[:, None],
        course.alpha,
        course.beta,
        course.velocities,
        course.accelerations,
        course.elapsed[:, None],
        plain,
        all_bent_along(model.terms, np.hstack([course.alpha, course.beta])),
        model.parameters.values,
        geometry.as_vector(),
        np.array([COULOMB_EPSILON]),
    )[..., 0]
    shaft, motor_loads = found[:, :4].copy(), found[:, 4:8]
    twists, motor_inertia = np.zeros_like(shaft), float(found[0, 8])
    for spring in (spring for spring in model.springs if spring.is_gear):
        twist = _twist(spring, geometry.gear_ratio * shaft[:, spring.place] - motor_loads[:, spring.place], sample_time)
        twists[:, spring.place] = twist
        shaft[:, spring.place] += motor_inertia * second_derivative(twist, sample_time) / geometry.gear_ratio
    asked = _asked_function(model.terms)(shaft, course.beta + twists, geometry.as_vector())[..., 0]
    ahead = _ahead_of_filters(asked, model.drive_lags(), sample_time)
    return Demand(_earlier(ahead, model.drive_delays(), sample_time), twists)


def _ahead_of_filters(torques: Array, lags: Array, sample_time: float) -> Array:
    """What filters of these time constants (4,) [s] are asked for, where torques (N, 4) are to come out of them."""
    if not lags.any():
        return torques
    smooth = zero_phase(torques, TWIST_CUTOFF, sample_time)
    return np.asarray(torques + lags * differentiate(smooth, sample_time))


def _twist(spring: Spring, load: Array, sample_time: float) -> Array:
    """(N,) [rad] under a load (N,) [Nm at the wheel]."""
    resting = resting_twist(load, float(stiffness_of(spring.compliance)), spring.gap)
    return zero_phase(np.asarray(resting, dtype=float).reshape(-1), TWIST_CUTOFF, sample_time)


def _wheels_function(mode: Mode, terms: Sequence[Term]) -> Vectorised:
    """Torques at the shafts of rigid gears (4,), what of them accelerates the motors, at the wheels (4,), B_m."""
    width = len(GENERALIZED_VELOCITIES[mode])
    heading, alpha, beta, plain = (ca.SX.sym(name, size) for name, size in (("γ", 1), ("α", 2), ("β", 4), ("u", 4)))
    velocity, acceleration = ca.SX.sym("v", width), ca.SX.sym("a", width)
    p = ca.SX.sym("p", len(PARAMETER_NAMES))
    H = on_radii(symbolic.complement(mode, alpha), rolling_radii(terms, beta))
    rates = H @ velocity
    accelerations = ca.jtimes(rates, alpha, rates[3:5]) + ca.jtimes(rates, beta, rates[5:]) + H @ acceleration
    elapsed, loads = ca.SX.sym("t"), ca.SX.sym("load", 4)
    joints = bristles_of(terms)
    bent = ca.SX.sym("z", len(joints))
    by_joint = dict(zip(joints, ca.vertsplit(bent), strict=True))
    state = State(heading, alpha, beta, rates, accelerations, elapsed, loads, by_joint)
    parameters = changed_parameters(terms, p, state)
    forces = added_forces(terms, state, parameters)
    wanted = H.T @ (symbolic.regressor(rates, accelerations) @ parameters + forces)
    driven = H.T @ symbolic.input_matrix()
    local = plain + _at_its_place(forces)
    torques = local + driven.T @ ca.solve(driven @ driven.T, wanted - driven @ local)
    motor = MOTOR_SHARE * parameters[PARAMETER_NAMES.index("B_w")]
    gears = [spring.place for spring in springs_of(terms) if spring.is_gear]
    soft = ca.SX([float(wheel in gears) for wheel in range(4)])
    torques = _under_its_load(torques, loads, plain, soft * motor * accelerations[5:])
    results = ca.densify(ca.vertcat(torques, motor * accelerations[5:], motor))
    motion = [heading, alpha, beta, velocity, acceleration, elapsed, plain, bent, p]
    return Vectorised(ca.Function("torques", [*motion, symbolic.GEOMETRY, symbolic.EPSILON], [ca.cse(results)]))


def _under_its_load(torques: Expression, loads: Expression, first: Expression, at_motors: Expression) -> Expression:
    """Torques (4,) that make the loads (4,) which they depend on; each round leaves a share of the error."""
    found = first
    for _ in range(LOAD_ROUNDS if ca.depends_on(torques, loads) else 0):
        found = ca.cse(ca.substitute(torques, loads, symbolic.LENGTHS.i_G * found - at_motors))
    return found if ca.depends_on(torques, loads) else torques


def _at_its_place(forces: Expression) -> Expression:
    """Motor torques (4,) against friction of wheels and steering sides, each by the wheels concerned."""
    lengths = symbolic.LENGTHS
    left, right = (forces[row] * lengths.r / (2 * lengths.a * lengths.i_G) for row in (3, 4))
    return forces[5:] / lengths.i_G + ca.vertcat(-left, left, right, -right)


def _asked_function(terms: Sequence[Term]) -> Vectorised:
    """Torques that the drives must believe to give for others to act at their shafts: `shaft_torques` backwards."""
    torques, angles, reported = (ca.SX.sym(name, 4) for name in ("u", "angles", "reported"))
    true = shaft_torques(terms, reported, angles)
    offset = ca.substitute(true, reported, ca.SX.zeros(4))
    asked = ca.solve(ca.jacobian(true, reported), torques - offset)
    return Vectorised(ca.Function("asked", [torques, angles, symbolic.GEOMETRY], [ca.cse(ca.densify(asked))]))


def _earlier(torques: Array, delays: Array, sample_time: float) -> Array:
    time = np.arange(len(torques)) * sample_time
    moved = [np.interp(time + delay, time, column) for column, delay in zip(torques.T, delays, strict=True)]
    return np.stack(moved, axis=1)

"""The validation manoeuvre: a steered lane change on the move."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import integrate, optimize

from ident.campaign.reference import SETTLING, Reference, Track, sample_times, smooth_step, steering_tracks
from ident.plant import dynamics, kinematics
from ident.plant.modes import Mode
from ident.records.record import Step
from ident.vehicle.description import VehicleDescription
from ident.vehicle.geometry import Geometry
from ident.vehicle.parameters import Parameters

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LaneChange:
    """The validation manoeuvre: a steered shift to the left on the move.

    Attributes:
        speed: of the chassis [m/s].
        acceleration: mean, at start and end [m/s²].
        shift: to the left [m].
        length: of the shift along the path [m].
    """

    speed: float = 0.9
    acceleration: float = 0.5
    shift: float = 1.2
    length: float = 5.0


def lane_change_reference(
    manoeuvre: LaneChange, vehicle: VehicleDescription, parameters: Parameters, sample_time: float
) -> Reference:
    """Speed up, shift the lane with a curvature that starts and ends smoothly, slow down."""
    geometry = vehicle.geometry
    travel, velocity, acceleration = _speed_profile(manoeuvre, sample_time)
    run_in = (travel[-1] - manoeuvre.length) / 2
    curvature = _curvature_of_shift(manoeuvre)(travel - run_in)
    alpha_v = np.arctan(curvature * geometry.wheelbase / 2)
    alpha_v_rate = np.gradient(alpha_v, sample_time)
    velocities = np.stack([alpha_v_rate, velocity], axis=1)
    accelerations = np.stack([np.gradient(alpha_v_rate, sample_time), acceleration], axis=1)
    alpha = kinematics.steering_from_virtual(alpha_v, geometry)
    torques = _self_sufficient_sides(alpha, velocities, accelerations, geometry, parameters)
    column = kinematics.complement(Mode.STEERED, alpha, geometry)[:, 5:, 1]
    tracks = {
        **steering_tracks(alpha, np.gradient(alpha, sample_time, axis=0), geometry),
        "x": Track(travel, velocity, column),
    }
    twist = np.stack([velocity, np.zeros_like(velocity), curvature * velocity], axis=1)
    path = kinematics.integrate_pose(twist, sample_time)
    return Reference(Step.LANE_CHANGE, "x", sample_time, tracks, torques, np.full(len(travel), -1), path)


def _self_sufficient_sides(
    alpha: Array, velocities: Array, accelerations: Array, geometry: Geometry, parameters: Parameters
) -> Array:
    """Feed-forward of steered motion in which each side brings the torque that its own steering needs.

    It satisfies (21), whose α_v row is a combination of both steering rows, but not with the least torque: that one
    leaves the difference between the sides to the constraint forces, and wheels that carry steering torque slip.
    """
    rates, lifted = dynamics.lift_velocities(Mode.STEERED, alpha, velocities, accelerations, geometry)
    wanted, matrix = [], []
    for mode, rows in ((Mode.ALIGNMENT, [0, 1]), (Mode.STEERED, [1])):
        theta = dynamics.projected_regressor(mode, alpha, rates, lifted, geometry)
        wanted.append((theta @ parameters.values)[:, rows])
        matrix.append(dynamics.projected_input(mode, alpha, geometry)[:, rows])
    inverse = np.linalg.pinv(np.concatenate(matrix, axis=1))
    return np.asarray(np.einsum("nij,nj->ni", inverse, np.concatenate(wanted, axis=1)))


def _speed_profile(manoeuvre: LaneChange, sample_time: float) -> tuple[Array, Array, Array]:
    ramp = manoeuvre.speed / manoeuvre.acceleration
    run_in = manoeuvre.speed * ramp / 2 + 0.3
    cruise = (manoeuvre.length + 2 * (run_in - manoeuvre.speed * ramp / 2)) / manoeuvre.speed
    samples = round((2 * ramp + cruise + 2 * SETTLING) / sample_time)
    time = sample_times(samples, sample_time) - SETTLING
    up, up_rate, _ = smooth_step(time / ramp)
    down, down_rate, _ = smooth_step((time - ramp - cruise) / ramp)
    velocity = manoeuvre.speed * (up - down)
    acceleration = manoeuvre.speed * (up_rate - down_rate) / ramp
    steps = (velocity[1:] + velocity[:-1]) * sample_time / 2
    return np.concatenate([[0.0], np.cumsum(steps)]), velocity, acceleration


def _curvature_of_shift(manoeuvre: LaneChange) -> _CurvatureOfShift:
    """The curvature whose path ends beside its start by the shift asked for; the heading returns by itself."""
    arc = np.linspace(0.0, manoeuvre.length, 2001)
    heading = integrate.cumulative_trapezoid(_CurvatureOfShift(1.0, manoeuvre.length)(arc), arc, initial=0.0)

    def excess(amplitude: float) -> float:
        return float(integrate.trapezoid(np.sin(amplitude * heading), arc)) - manoeuvre.shift

    steepest = math.pi / 2 / float(np.abs(heading).max())
    return _CurvatureOfShift(float(optimize.brentq(excess, 0.0, steepest)), manoeuvre.length)


@dataclass(frozen=True)
class _CurvatureOfShift:
    """κ(s) = A (sin 2πσ - ½ sin 4πσ), σ = s/length: zero with zero slope at both ends."""

    amplitude: float
    length: float

    def __call__(self, arc: Array) -> Array:
        phase = 2 * math.pi * np.clip(arc / self.length, 0.0, 1.0)
        return np.asarray(self.amplitude * (np.sin(phase) - np.sin(2 * phase) / 2))

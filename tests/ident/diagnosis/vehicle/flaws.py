"""Flaws of a vehicle in its records, by hand: nothing here comes from the candidates' formulas."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ident.records.record import Segment
from ident.vehicle.description import VehicleDescription
from ident.vehicle.parameters import COULOMB_EPSILON


def sticky(segment: Segment, vehicle: VehicleDescription, friction: float, fall: float) -> Segment:
    """Friction of the right steering that is so much larger [Nm] near standstill, and falls over a rate [rad/s]."""
    g, rate = vehicle.geometry, np.gradient(segment.steering_angles[:, 1], segment.sample_time)
    extra = friction * np.exp(-((rate / fall) ** 2)) * np.tanh(rate / COULOMB_EPSILON)
    wheels = extra * g.wheel_radius / (2 * g.wheel_offset * g.gear_ratio)
    return replace(
        segment, motor_torques=segment.motor_torques + np.stack([0 * wheels, 0 * wheels, wheels, -wheels], 1)
    )


def rippled(segment: Segment, vehicle: VehicleDescription, amplitude: float) -> Segment:
    """A motor that gives more or less than it reports [Nm], twice a revolution."""
    torque = amplitude * np.sin(2 * vehicle.geometry.gear_ratio * segment.wheel_angles[:, 2] + 0.4)
    return replace(segment, motor_torques=segment.motor_torques - torque[:, None] * np.array([0, 0, 1, 0]))


def rippled_alike(segment: Segment, vehicle: VehicleDescription, amplitude: float) -> Segment:
    """The same of all four motors, each over its own angle, which begins anywhere."""
    angles = segment.wheel_angles + np.array([0.0, 0.3, 1.1, 2.0])
    torques = amplitude * np.sin(2 * vehicle.geometry.gear_ratio * angles + 0.4)
    return replace(segment, wheel_angles=angles, motor_torques=segment.motor_torques - torques)

"""A step of the campaign seen as one axis: J s̈ + D ṡ + F sgn ṡ = τ, and what its drives feel of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.campaign.steps import StepSpec
from ident.plant import dynamics, kinematics
from ident.plant.modes import Mode
from ident.vehicle.description import VehicleDescription
from ident.vehicle.parameters import COULOMB_EPSILON

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Axis:
    """One generalized coordinate at fixed steering angles, by the prior parameters.

    Attributes:
        inertia, viscous, coulomb: J, D, F of the coordinate.
        motor_torque: largest motor torque per generalized torque.
        wheel_rate: largest wheel rate per rate of the coordinate.
        wheel_load: wheel torque per contact force [m], the wheel radius; zero in the air.
        slipping_inertia: what is left of J when the wheels lose their grip.
        holding_acceleration: acceleration at which the contact forces overcome the friction that holds the
            steering; infinite where front and rear wheels cancel, as in all modes but the lateral one.
    """

    inertia: float
    viscous: float
    coulomb: float
    motor_torque: float
    wheel_rate: float
    wheel_load: float
    slipping_inertia: float
    holding_acceleration: float

    def torque(self, velocity: Array, acceleration: Array) -> Array:
        """Generalized torque of a motion."""
        friction = self.viscous * velocity + self.coulomb * np.tanh(velocity * self.wheel_rate / COULOMB_EPSILON)
        return self.inertia * acceleration + friction


def axis_of(spec: StepSpec, vehicle: VehicleDescription) -> Axis:
    """The axis that a step drives, from equation (19) with the prior parameters."""
    prior, geometry = vehicle.prior, vehicle.geometry
    if spec.mode is None:
        return Axis(
            prior["B_w"], prior["d_vw"], prior["d_cw"], 1 / geometry.gear_ratio, 1.0, 0.0, prior["B_w"], math.inf
        )
    alpha = np.tile(spec.steering(geometry), (3, 1))
    row = kinematics.GENERALIZED_VELOCITIES[spec.mode].index(spec.coordinate)
    velocity, acceleration = np.zeros((2, 3, len(kinematics.GENERALIZED_VELOCITIES[spec.mode])))
    velocity[:, row] = (0.0, 1.0, 2.0)
    acceleration[:, row] = (1.0, 0.0, 0.0)
    rates, lifted = dynamics.lift_velocities(spec.mode, alpha, velocity, acceleration, geometry)
    theta = dynamics.projected_regressor(spec.mode, alpha, rates, lifted, geometry)
    torque = (theta @ prior.values)[:, row]
    inverse = np.linalg.pinv(dynamics.projected_input(spec.mode, alpha[:1], geometry)[0])
    return Axis(
        inertia=float(torque[0]),
        viscous=float(torque[2] - torque[1]),
        coulomb=float(2 * torque[1] - torque[2]),
        motor_torque=float(np.abs(inverse[:, row]).max()),
        wheel_rate=float(np.abs(rates[1, 5:]).max()),
        wheel_load=geometry.wheel_radius,
        slipping_inertia=float(prior["B_w"] * np.sum(rates[1, 5:] ** 2)),
        holding_acceleration=_holding_acceleration(spec, vehicle),
    )


def _holding_acceleration(spec: StepSpec, vehicle: VehicleDescription) -> float:
    """In lateral motion the four contact forces m ÿ/4 turn both wheels of a side the same way, by their lever a."""
    if spec.mode is not Mode.LATERAL:
        return math.inf
    prior = vehicle.prior
    return 2 * min(prior["d_cl"], prior["d_cr"]) / (vehicle.geometry.wheel_offset * prior["m_ch"])

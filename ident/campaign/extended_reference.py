"""Feed-forward of a model with effects for the lane change."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import integrate

from ident.campaign.feed_forward import Course, feed_forward
from ident.campaign.reference import STEERING_LOOPS, Reference
from ident.effects.extended import ExtendedModel
from ident.plant.kinematics import virtual_steering
from ident.plant.modes import Mode
from ident.vehicle.geometry import Geometry

Array = NDArray[np.float64]


def with_effects(reference: Reference, model: ExtendedModel, geometry: Geometry, elapsed: float = 0.0) -> Reference:
    """The reference of steered motion with the torques that the effects ask for.

    Args:
        reference: of a lane change, its torques those of the plain model with the same parameters.
        model: with its effects.
        geometry: of the vehicle.
        elapsed: time since the start of the campaign at which it is driven [s].
    """
    dt = reference.sample_time
    alpha = np.stack([reference.tracks[loop].position for loop in STEERING_LOOPS], axis=1)
    x = reference.tracks["x"]
    velocities = np.stack([np.gradient(virtual_steering(alpha, geometry), dt), x.velocity], axis=1)
    wheel_rates = x.wheels * x.velocity[:, None]
    for loop in STEERING_LOOPS:
        wheel_rates = wheel_rates + reference.tracks[loop].wheels * reference.tracks[loop].velocity[:, None]
    course = Course(
        mode=Mode.STEERED,
        heading=reference.path[:, 2],
        alpha=alpha,
        beta=np.asarray(integrate.cumulative_trapezoid(wheel_rates, dx=dt, axis=0, initial=0.0)),
        velocities=velocities,
        accelerations=np.gradient(velocities, dt, axis=0),
        elapsed=elapsed + dt * np.arange(len(reference), dtype=np.float64),
    )
    demand = feed_forward(model, course, reference.feed_forward, geometry, dt)
    return replace(reference, feed_forward=demand.torques)

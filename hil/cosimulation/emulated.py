"""A record's torques through the emulated vehicle, held to the record's motion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from emulator.engine.choice import ENGINES
from emulator.prototype import Prototype
from emulator.replay import Guide, ReplayedVehicle, Start
from ident.diagnosis.vehicle.records.following import Following
from ident.effects import Effect
from ident.extras import EngineName
from ident.plant import kinematics
from ident.stages import Stage, untold
from ident.vehicle.geometry import Geometry

Array = NDArray[np.float64]

ENGINE_STEP: Final = 1e-3
"""Longest step of the engine [s]."""


def forces_of(
    prototype: Prototype,
    effects: Sequence[Effect],
    engine: EngineName,
    followings: Sequence[Following],
    stage: Stage = untold,
) -> list[Array]:
    """Forces (N, n) that hold the vehicle to each segment's motion, beyond the recorded torques [N or Nm].

    Args:
        prototype, effects: what the vehicle is.
        engine: of its physics.
        followings: segments, all sampled alike.
        stage: told which step is driven.

    Raises:
        UserError: the vehicle cannot have these effects.
    """
    sample_time = followings[0].segment.sample_time
    steps = math.ceil(sample_time / ENGINE_STEP - 1e-6)
    step, forces = sample_time / steps, []
    vehicle = ReplayedVehicle(prototype, effects=effects, make_engine=ENGINES[engine], engine_step=step)
    with vehicle:
        for following in followings:
            segment = following.segment
            stage(segment.step)
            vehicle.stand(lifted=following.lifted, load=segment.payload)
            start = _start(following, prototype.geometry, step)
            forces.append(np.array(vehicle.follow(start, segment.motor_torques.tolist(), _guide(following), steps)))
    return forces


def _guide(following: Following) -> Guide:
    return Guide(
        following.readings.tolist(),
        following.signals.joint_rates.tolist(),
        following.weights.tolist(),
        following.stiffness.tolist(),
        following.damping.tolist(),
    )


def _start(following: Following, geometry: Geometry, engine_step: float) -> Start:
    """The recorded state at the first sample, rates of half an engine step before it."""
    signals, ago = following.signals, engine_step / 2
    alpha, beta = signals.alpha[:1], signals.beta[:1]
    steering = signals.alpha_rate[:1] - ago * signals.alpha_acceleration[:1]
    wheels = signals.beta_rate[:1] - ago * signals.beta_acceleration[:1]
    twist = kinematics.odometry(alpha, steering, wheels, geometry)
    return Start(
        time=float(signals.segment.time[0]),
        heading=float(signals.heading[0]),
        twist=(0.0, 0.0, 0.0) if following.lifted else tuple(twist[0].tolist()),
        steering=tuple(alpha[0].tolist()),
        wheels=tuple(beta[0].tolist()),
        steering_rates=tuple(steering[0].tolist()),
        wheel_rates=tuple(wheels[0].tolist()),
    )

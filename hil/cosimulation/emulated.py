"""A record's torques through the emulated vehicle, window by window."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

import numpy as np
from numpy.typing import NDArray

from emulator.engine.choice import ENGINES
from emulator.prototype import Prototype
from emulator.replay import ReplayedVehicle, Start
from ident.diagnosis.vehicle.shooting import Simulate, Windows
from ident.effects import Effect
from ident.extras import EngineName
from ident.plant import kinematics
from ident.vehicle.geometry import Geometry

Array = NDArray[np.float64]

ENGINE_STEP: Final = 1e-3
"""Longest step of the engine [s]."""


@contextmanager
def emulated(
    prototype: Prototype, effects: tuple[Effect, ...], engine: EngineName, sample_time: float
) -> Iterator[Simulate]:
    """A vehicle as a simulator of windows.

    Args:
        prototype, effects: what it is.
        engine: of its physics.
        sample_time: of the record [s].

    Raises:
        UserError: the vehicle cannot have these effects.
    """
    steps = math.ceil(sample_time / ENGINE_STEP - 1e-6)
    vehicle = ReplayedVehicle(prototype, effects=effects, make_engine=ENGINES[engine], engine_step=sample_time / steps)
    with vehicle:
        yield lambda windows: _simulate(vehicle, windows, prototype.geometry, steps)


def _simulate(vehicle: ReplayedVehicle, windows: Windows, geometry: Geometry, steps: int) -> Array:
    segment = windows.segment
    vehicle.stand(lifted=windows.lifted, load=segment.payload)
    starts = _starts(windows, geometry, segment.sample_time / steps)
    torques = segment.motor_torques[windows.samples]
    runs = [vehicle.run(start, own.tolist(), steps) for start, own in zip(starts, torques, strict=True)]
    return np.array(runs)


def _starts(windows: Windows, geometry: Geometry, engine_step: float) -> Iterator[Start]:
    signals = windows.signals
    ago = engine_step / 2
    steering = signals.alpha_rate - ago * signals.alpha_acceleration
    wheels = signals.beta_rate - ago * signals.beta_acceleration
    twist = kinematics.odometry(signals.alpha, steering, wheels, geometry)
    if windows.lifted:
        twist = np.zeros_like(twist)
    for sample in windows.starts.tolist():
        yield Start(
            time=float(signals.segment.time[sample]),
            heading=float(signals.heading[sample]),
            twist=tuple(twist[sample].tolist()),
            steering=tuple(signals.alpha[sample].tolist()),
            wheels=tuple(signals.beta[sample].tolist()),
            steering_rates=tuple(steering[sample].tolist()),
            wheel_rates=tuple(wheels[sample].tolist()),
        )

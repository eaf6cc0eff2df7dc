"""A vehicle with effects, without noise, and simple ways to move it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from emulator.engine.protocol import MakeEngine
from emulator.prototype import Prototype, load_prototype
from emulator.vehicle import EmulatedVehicle
from ident.effects.text import parse_effect

SIGNS = (1, 1, -1, -1)
"""Mounting of the drives of the prototype: fl, rl, fr, rr."""

STEP = 1e-3


@dataclass
class Moving:
    """A vehicle whose wheels are torqued or held at a speed, and what it did."""

    vehicle: EmulatedVehicle
    prototype: Prototype

    def torque(self, wheel_torques: list[float], duration: float) -> None:
        """Wheel torques (4,) as the drives report them [Nm]."""
        gear = self.prototype.geometry.gear_ratio
        for drive, sign, torque in zip(self.vehicle.drives, SIGNS, wheel_torques, strict=True):
            drive.command(sign * torque / gear)
        self.vehicle.advance(duration)

    def hold_speed(self, rates: list[float], duration: float) -> NDArray[np.float64]:
        """Mean reported wheel torques (4,) [Nm] that hold the wheels at `rates` [rad/s], over the last half."""
        gear, integral, kept = self.prototype.geometry.gear_ratio, np.zeros(4), []
        for index in range(round(duration / STEP)):
            now = np.array([s * d.velocity() / gear for s, d in zip(SIGNS, self.vehicle.drives, strict=True)])
            error = np.array(rates) - now
            integral += 40.0 * error * STEP
            self.torque(list(8.0 * error + integral), STEP)
            if index > duration / STEP / 2:
                kept.append(self.reported())
        return np.mean(kept, axis=0)

    def reported(self) -> NDArray[np.float64]:
        """Wheel torques (4,) that the drives report [Nm]."""
        gear = self.prototype.geometry.gear_ratio
        return np.array([s * gear * d.measured_torque() for s, d in zip(SIGNS, self.vehicle.drives, strict=True)])

    def motor_angles(self) -> NDArray[np.float64]:
        """Angles (4,) that the motor encoders report, at the wheels [rad]."""
        scale = 2 * np.pi / self.prototype.drive.counts_per_revolution / self.prototype.geometry.gear_ratio
        return np.array([s * d.position() * scale for s, d in zip(SIGNS, self.vehicle.drives, strict=True)])


Make = Callable[..., Moving]


@pytest.fixture
def make(make_engine: MakeEngine) -> Iterator[Make]:
    """Builds vehicles with effects, on the floor or lifted, drives on."""
    made: list[EmulatedVehicle] = []

    def build(*texts: str, name: str = "prototype", lifted: bool = False) -> Moving:
        prototype = load_prototype(name)
        effects = [parse_effect(text) for text in texts]
        vehicle = EmulatedVehicle(prototype, seed=1, noise_scale=0.0, make_engine=make_engine, effects=effects)
        made.append(vehicle)
        if lifted:
            vehicle.lift()
        for drive in vehicle.drives:
            drive.enable()
        return Moving(vehicle, prototype)

    yield build
    for vehicle in made:
        vehicle.close()

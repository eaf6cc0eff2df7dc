"""The simplest hardware that obeys a law of motion: four flywheels with viscous friction, two fixed angles.

It stands in for the vehicle where only the protocol is of interest, without a physics engine.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from emulator.power_stage import Trip


@dataclass
class FlywheelDrive:
    """A motor with a flywheel: inertia [kg m^2], friction [Nm s/rad]; angle [rad], speed [rad/s]."""

    rated_torque: float = 1.27
    rated_current: float = 2.6
    counts_per_revolution: int = 1048576
    inertia: float = 1e-3
    friction: float = 1e-3
    enabled: bool = False
    angle: float = 0.0
    speed: float = 0.0
    torque: float = 0.0
    voltage: float = 282.0
    voltage_range: tuple[float, float] = (380.0, 410.0)
    thermal_load: float = 0.0
    tripped: Callable[[Trip], None] | None = None

    def watch(self, tripped: Callable[[Trip], None]) -> None:
        """Call `tripped` on `trip`; nothing else makes this protection respond."""
        self.tripped = tripped

    def trip(self, cause: Trip) -> None:
        """Let the protection respond."""
        if self.tripped is not None:
            self.tripped(cause)

    def enable(self) -> None:
        """Switch the power stage on, at zero torque."""
        self.enabled = True
        self.torque = 0.0

    def disable(self) -> None:
        """Switch the power stage off."""
        self.enabled = False
        self.torque = 0.0

    def command(self, torque: float) -> None:
        """Apply a torque [Nm] while the power stage is on."""
        self.torque = torque if self.enabled else 0.0

    def control(self, torque: float) -> None:
        """Apply a torque [Nm] while the power stage is on."""
        self.command(torque)

    def measured_torque(self) -> float:
        """The torque applied [Nm]."""
        return self.torque

    def position(self) -> int:
        """Shaft position [counts]."""
        return math.floor(self.angle / (2.0 * math.pi) * self.counts_per_revolution)

    def velocity(self) -> float:
        """Shaft velocity [rad/s]."""
        return self.speed

    def advance(self, duration: float) -> None:
        """Exact solution of J dw/dt + d w = M over `duration` [s] at constant torque."""
        final = self.torque / self.friction
        rate = self.friction / self.inertia
        decay = -math.expm1(-rate * duration)
        self.angle += final * duration + (self.speed - final) * decay / rate
        self.speed += (final - self.speed) * decay


@dataclass
class FixedEncoder:
    """An encoder on an axis that stands still."""

    counts_per_revolution: int = 131072
    counts: int = 65536

    def position(self) -> int:
        """Physical position [counts]."""
        return self.counts


class Flywheels:
    """Four flywheel drives and two fixed encoders, as hardware of a `DeviceNetwork`."""

    def __init__(self) -> None:
        self.drives = tuple(FlywheelDrive() for _ in range(4))
        self.encoders = (FixedEncoder(), FixedEncoder())
        self.time = 0.0

    def advance(self, duration: float) -> None:
        """Let `duration` seconds pass."""
        self.time = round(self.time + duration, 9)
        for drive in self.drives:
            drive.advance(duration)

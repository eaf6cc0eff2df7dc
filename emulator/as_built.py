"""The vehicle as it is built and where it stands: the prototype, and in what it deviates from its files."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

from emulator.prototype import Prototype
from emulator.rigid_bodies import RigidBody
from ident.vehicle.quantities import GRAVITY


@dataclass(frozen=True)
class WheelBuild:
    """One wheel.

    Attributes:
        radius: of the tyre [m].
        body: mass and inertias.
        eccentricity: distance of the tyre's centre from the axle [m]; the rolling radius is
            radius + eccentricity cos(beta + phase).
        phase: [rad].
        grip: friction coefficient of the tyre; the engine multiplies it by the floor's [-].
        patch_torque: with which the contact patch resists turning on the spot, at a quarter of the weight [Nm].
    """

    radius: float
    body: RigidBody
    eccentricity: float = 0.0
    phase: float = 0.0
    grip: float = 1.0
    patch_torque: float = 0.0


@dataclass(frozen=True)
class SoftCoupling:
    """The coupling of front and rear unit of a side as a spring with play.

    Attributes:
        compliance: twist per torque [rad/Nm].
        gap: whole play [rad].
    """

    compliance: float
    gap: float = 0.0


@dataclass(frozen=True)
class AsBuilt:
    """A vehicle on a floor.

    Attributes:
        prototype: its truth, masses and inertias as they are.
        wheels: (4,) fl, rl, fr, rr.
        couplings: of left and right side; None is rigid.
        slope: inclination of the floor [rad].
        uphill: heading in the world that points uphill [rad].
    """

    prototype: Prototype
    wheels: tuple[WheelBuild, ...]
    couplings: tuple[SoftCoupling | None, SoftCoupling | None] = (None, None)
    slope: float = 0.0
    uphill: float = 0.0

    @classmethod
    def of(cls, prototype: Prototype) -> Self:
        """Built as its files say, on a level floor."""
        wheel = WheelBuild(prototype.geometry.wheel_radius, prototype.rigid_bodies.wheel)
        return cls(prototype, (wheel,) * 4)

    @property
    def gravity(self) -> tuple[float, float, float]:
        """Acceleration of gravity in the world, whose z is normal to the floor [m/s^2]."""
        down_the_slope = -GRAVITY * math.sin(self.slope)
        return (
            down_the_slope * math.cos(self.uphill),
            down_the_slope * math.sin(self.uphill),
            -GRAVITY * math.cos(self.slope),
        )

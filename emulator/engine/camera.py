"""Where the vehicle is looked at from, in every engine: from its left rear, wherever it goes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from emulator.prototype import Prototype

WIDTH: Final = 1280
HEIGHT: Final = 720
"""Of a picture [pixels]."""

VIEW_ANGLE: Final = 40.0
"""Between the upper and the lower edge of a picture [deg]."""

_ASIDE: Final = math.radians(38.0)
"""By how much the camera looks to the right of the vehicle's heading [rad]."""

_ELEVATION: Final = math.radians(-36.0)
_DISTANCE: Final = 1.5
"""Of the camera over the sum of wheelbase and track width."""

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Camera:
    """A camera whose upper edge is level.

    Attributes:
        target: what it looks at, in the world [m].
        distance: from there [m].
        azimuth: direction in which it looks, about z from x [rad].
        elevation: of that direction above the horizon, negative downward [rad].
    """

    target: Vector
    distance: float
    azimuth: float
    elevation: float

    @property
    def forward(self) -> Vector:
        """Direction in which it looks, of length one."""
        flat = math.cos(self.elevation)
        return flat * math.cos(self.azimuth), flat * math.sin(self.azimuth), math.sin(self.elevation)

    @property
    def eye(self) -> Vector:
        """Where it is, in the world [m]."""
        (x, y, z), (fx, fy, fz) = self.target, self.forward
        return x - self.distance * fx, y - self.distance * fy, z - self.distance * fz


def heading(orientation: Sequence[float]) -> float:
    """Direction of a body's x axis about z [rad], of its quaternion (x, y, z, w)."""
    return 2 * math.atan2(orientation[2], orientation[3])


def follow(prototype: Prototype, position: Sequence[float], orientation: Sequence[float]) -> Camera:
    """The camera behind the left rear quarter of a vehicle.

    Args:
        prototype: whose size it has.
        position: of the chassis' centre in the world [m].
        orientation: its quaternion (x, y, z, w).
    """
    geometry = prototype.geometry
    return Camera(
        (position[0], position[1], position[2]),
        _DISTANCE * (geometry.wheelbase + geometry.track_width),
        heading(orientation) - _ASIDE,
        _ELEVATION,
    )

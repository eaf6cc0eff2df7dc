"""What every engine's description of the vehicle shares: names, corners, order.

Frames: x forward, y left, z up. Body `chassis` with its origin over the centre of the four steering axes; joint
`steering_<wheel>` about z at each corner; joint `rolling_<wheel>` about the wheel's axle (y of the knuckle),
positive when the wheel rolls forward.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from emulator.as_built import WheelBuild
from emulator.prototype import Prototype
from ident.vehicle.geometry import WHEELS
from ident.vehicle.parameters import Parameters

SIDE_SIGN: Final = {"fl": 1.0, "rl": 1.0, "fr": -1.0, "rr": -1.0}
"""+1 left, -1 right."""
END_SIGN: Final = {"fl": 1.0, "rl": -1.0, "fr": 1.0, "rr": -1.0}
"""+1 front, -1 rear."""

Vector = tuple[float, float, float]


def steering_joint(wheel: str) -> str:
    """Name of the steering joint of a wheel."""
    return f"steering_{wheel}"


def rolling_joint(wheel: str) -> str:
    """Name of the rolling joint of a wheel."""
    return f"rolling_{wheel}"


JOINTS: Final = tuple(steering_joint(wheel) for wheel in WHEELS) + tuple(rolling_joint(wheel) for wheel in WHEELS)
"""The eight joints in the order of `emulator.engine.protocol.Engine`."""


def corner(prototype: Prototype, wheel: str) -> Vector:
    """Where the steering axis of a wheel crosses the height of the axles, in the chassis frame [m]."""
    geometry = prototype.geometry
    return (
        END_SIGN[wheel] * geometry.wheelbase / 2,
        SIDE_SIGN[wheel] * geometry.track_width / 2,
        geometry.wheel_radius - prototype.body.centre_height,
    )


def axle(prototype: Prototype, wheel: str, build: WheelBuild) -> Vector:
    """Centre of a wheel in the frame of its knuckle [m].

    The axle of a larger wheel sits higher, so that all four wheels stand on the floor alike.
    """
    geometry = prototype.geometry
    return (0.0, SIDE_SIGN[wheel] * geometry.wheel_offset, build.radius - geometry.wheel_radius)


def tyre_centre(build: WheelBuild) -> Vector:
    """Centre of the tyre in the frame of the wheel [m]; turned by beta, it is e cos(beta + phase) below the axle."""
    return (-build.eccentricity * math.sin(build.phase), 0.0, -build.eccentricity * math.cos(build.phase))


def joint_coulomb(truth: Parameters) -> list[float]:
    """Dry friction of the eight joints [Nm]: a side's is shared by its two units."""
    return [truth[symbol] / 2 for symbol in ("d_cl", "d_cl", "d_cr", "d_cr")] + [truth["d_cw"]] * 4


def planar_twist(velocity: Sequence[float], yaw_rate: float, orientation: Sequence[float]) -> Vector:
    """(x', y', gamma') in the chassis frame of a velocity in the world [m/s, m/s, rad/s].

    Args:
        velocity: (x, y, ...) of the centre in the world [m/s].
        yaw_rate: [rad/s].
        orientation: quaternion (x, y, z, w) of the chassis.
    """
    heading = 2 * math.atan2(orientation[2], orientation[3])
    cosine, sine = math.cos(heading), math.sin(heading)
    return cosine * velocity[0] + sine * velocity[1], cosine * velocity[1] - sine * velocity[0], yaw_rate


def turned_to(heading: float, orientation: Sequence[float]) -> tuple[float, float, float, float]:
    """A chassis with another heading [rad] and the tilt that it has, quaternions (x, y, z, w)."""
    x, y, z, w = orientation
    turn = (heading - 2 * math.atan2(z, w)) / 2
    sine, cosine = math.sin(turn), math.cos(turn)
    return cosine * x - sine * y, cosine * y + sine * x, cosine * z + sine * w, cosine * w - sine * z


def in_world(twist: Vector, heading: float) -> tuple[Vector, Vector]:
    """Linear and angular velocity in the world of a twist (x', y', gamma') in the chassis frame."""
    ahead, left, yaw_rate = twist
    cosine, sine = math.cos(heading), math.sin(heading)
    return (cosine * ahead - sine * left, sine * ahead + cosine * left, 0.0), (0.0, 0.0, yaw_rate)

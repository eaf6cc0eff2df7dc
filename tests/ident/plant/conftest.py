"""A second derivation of the platform: wheels as rigid bodies in space, velocities by differentiating positions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.vehicle.geometry import Geometry

Array = NDArray[np.float64]

# (x, y) signs of the steering axes fl, rl, fr, rr; a front wheel turns by +alpha of its side, a rear wheel by -alpha.
CORNERS = ((1, 1), (-1, 1), (1, -1), (-1, -1))
STEP = 1e-6


def rotation(axis: str, angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return {
        "y": np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]),
        "z": np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]),
    }[axis]


def wheel_pose(q: Array, wheel: int, geometry: Geometry) -> tuple[Array, Array]:
    """World position of a wheel's centre and its orientation, for world coordinates (X, Y, gamma, alpha, beta)."""
    front, side = CORNERS[wheel]
    steering = front * q[3 if side > 0 else 4]
    carrier = rotation("z", q[2]) @ rotation("z", steering)
    corner = np.array([front * geometry.wheelbase / 2, side * geometry.track_width / 2, geometry.wheel_radius])
    axle = np.array([0.0, side * geometry.wheel_offset, 0.0])
    centre = np.array([q[0], q[1], 0.0]) + rotation("z", q[2]) @ corner + carrier @ axle
    return centre, carrier @ rotation("y", q[5 + wheel])


def contact_velocity(q: Array, rates: Array, wheel: int, geometry: Geometry) -> Array:
    """World velocity of the wheel's material point on the floor: v + omega x (0, 0, -r), by central differences."""
    _, orientation = wheel_pose(q, wheel, geometry)
    ahead, turned = wheel_pose(q + STEP * rates, wheel, geometry)
    behind, turned_back = wheel_pose(q - STEP * rates, wheel, geometry)
    velocity = (ahead - behind) / (2 * STEP)
    spin = (turned - turned_back) / (2 * STEP) @ orientation.T
    omega = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
    return velocity + np.cross(omega, [0.0, 0.0, -geometry.wheel_radius])


def slip(q: Array, rates: Array, geometry: Geometry) -> Array:
    """Lateral, then longitudinal slip velocities (8,) of the four contacts, in the frames of their wheels."""
    lateral, longitudinal = [], []
    for wheel, (front, side) in enumerate(CORNERS):
        heading = q[2] + front * q[3 if side > 0 else 4]
        velocity = contact_velocity(q, rates, wheel, geometry)
        longitudinal.append(velocity @ [np.cos(heading), np.sin(heading), 0.0])
        lateral.append(velocity @ [-np.sin(heading), np.cos(heading), 0.0])
    return np.array([*lateral, *longitudinal])


@pytest.fixture(scope="session")
def slip_of(geometry: Geometry) -> Callable[[Array, Array], Array]:
    return lambda q, rates: slip(q, rates, geometry)

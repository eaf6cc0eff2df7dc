"""The floor behind a vehicle as a camera sees it: squares of one metre that fade with the distance, and a shadow.

For an engine that draws a plane slowly or with jagged edges.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from emulator.engine.camera import VIEW_ANGLE, Camera
from emulator.prototype import Prototype

_LIGHT: Final = (214.0, 218.0, 222.0)
_DARK: Final = (178.0, 186.0, 194.0)
_SKY: Final = (235.0, 239.0, 244.0)
_FAR: Final = 25.0
"""Distance at which the floor has become the sky [m]."""
_SHADE: Final = 0.45
"""Light that the shadow of the body takes."""
_SOFT: Final = 0.12
"""Width of the edge of that shadow [m]."""

Pose = tuple[float, float, float]


def draw_floor(camera: Camera, width: int, height: int, prototype: Prototype, pose: Pose) -> NDArray[np.uint8]:
    """The floor z = 0 and the sky (height, width, 3).

    Args:
        camera: above the floor.
        width, height: [pixels].
        prototype: whose body throws the shadow.
        pose: x, y, gamma of the vehicle [m, m, rad].
    """
    x, y, ahead = _places(camera, width, height)
    # Edges as wide as a pixel is there: no steps along them, and no flicker far away.
    pixel = np.pi * ahead * 2 * math.tan(math.radians(VIEW_ANGLE) / 2) / height
    squares = np.clip(np.sin(np.pi * x) / pixel, -1, 1) * np.clip(np.sin(np.pi * y) / pixel, -1, 1)
    shade = 1 - _SHADE * _shadow(x, y, prototype, pose)
    fade = np.clip(ahead / _FAR, 0, 1)
    picture = np.empty((height, width, 3), np.uint8)
    for channel, (light, dark, sky) in enumerate(zip(_LIGHT, _DARK, _SKY, strict=True)):
        floor = ((light + dark) / 2 + (light - dark) / 2 * squares) * shade
        picture[..., channel] = floor + (sky - floor) * fade
    return picture


def _places(
    camera: Camera, width: int, height: int
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """Where on the floor each pixel is: x, y (height, width), and how far ahead (height, 1) [m]; far above it."""
    fx, fy, fz = camera.forward
    flat = math.hypot(fx, fy)
    across, up = (fy / flat, -fx / flat), (-fx / flat * fz, -fy / flat * fz, flat)
    half = math.tan(math.radians(VIEW_ANGLE) / 2)
    aside = np.asarray((2 * np.arange(width) + 1 - width) / height * half, np.float32)[None, :]
    rise = np.asarray((height - 1 - 2 * np.arange(height)) / height * half, np.float32)[:, None]
    ex, ey, ez = camera.eye
    # A ray that does not come down meets the floor nowhere: far away.
    ahead = ez / np.maximum(-(fz + rise * up[2]), ez / (10 * _FAR))
    x = ex + ahead * (fx + rise * up[0]) + ahead * across[0] * aside
    y = ey + ahead * (fy + rise * up[1]) + ahead * across[1] * aside
    return x.astype(np.float32), y.astype(np.float32), ahead.astype(np.float32)


def _shadow(x: NDArray[np.float32], y: NDArray[np.float32], prototype: Prototype, pose: Pose) -> NDArray[np.float32]:
    """How much of the light from above the body keeps away, 0 to 1."""
    body, geometry = prototype.body, prototype.geometry
    cosine, sine = math.cos(pose[2]), math.sin(pose[2])
    along = np.abs(cosine * (x - pose[0]) + sine * (y - pose[1])) - body.length / 2
    aside = np.abs(cosine * (y - pose[1]) - sine * (x - pose[0])) - geometry.track_width / 2
    return np.asarray(np.clip(0.5 - along / _SOFT, 0, 1) * np.clip(0.5 - aside / _SOFT, 0, 1), np.float32)

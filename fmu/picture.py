"""The vehicle from above for the documentation page: axes, order of the wheels, signs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from ident.plant.symbolic import CORNERS
from ident.vehicle.geometry import WHEELS, Geometry

_SIZE: Final = 520.0
"""Of the picture, either way."""

_FILLED: Final = 0.5
"""Part of it that the steering axes span."""

_LABEL: Final = 62.0
"""From the centre of a wheel outward to its label."""

_STEERED: Final = (0.45, 0.3)
"""Steering angles that are shown, left and right [rad]."""


@dataclass(frozen=True)
class WheelMark:
    """Where a wheel is drawn: its steering axis, its centre, its size, and its heading in degrees clockwise.

    The label lies outward of the wheel.
    """

    name: str
    angle: str
    axis: tuple[float, float]
    centre: tuple[float, float]
    label: tuple[float, float]
    length: float
    heading: float


@dataclass(frozen=True)
class Picture:
    """Coordinates of the drawing; forward is up."""

    size: float
    middle: float
    chassis: tuple[float, float, float, float]
    wheels: tuple[WheelMark, ...]


def picture_of(geometry: Geometry) -> Picture:
    """The picture of a vehicle.

    Args:
        geometry: its lengths.
    """
    scale, middle = _FILLED * _SIZE / max(geometry.wheelbase, geometry.track_width), _SIZE / 2

    def placed(ahead: float, left: float) -> tuple[float, float]:
        return round(middle - scale * left, 1), round(middle - scale * ahead, 1)

    wheels = []
    for name, (front, side) in zip(WHEELS, CORNERS, strict=True):
        steering = _STEERED[0 if side > 0 else 1]
        heading, sign = front * steering, "+" if front > 0 else "-"
        axis = front * geometry.wheelbase / 2, side * geometry.track_width / 2
        outward = side * geometry.wheel_offset
        centre = axis[0] - outward * math.sin(heading), axis[1] + outward * math.cos(heading)
        wheels.append(
            WheelMark(
                name=name,
                angle=f"{sign}alpha_{'l' if side > 0 else 'r'}",
                axis=placed(*axis),
                centre=placed(*centre),
                label=placed(centre[0], centre[1] + side * _LABEL / scale),
                length=round(2 * scale * geometry.wheel_radius, 1),
                heading=round(-math.degrees(heading), 1),
            )
        )
    corner = placed(0.58 * geometry.wheelbase, 0.42 * geometry.track_width)
    chassis = (*corner, round(2 * (middle - corner[0]), 1), round(2 * (middle - corner[1]), 1))
    return Picture(_SIZE, middle, chassis, tuple(wheels))

"""Geometry of the platform: four wheels on steering axes at the corners of a rectangle (paper, Fig. 2)."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ident.errors import DataFileError
from ident.vehicle.quantities import read_quantities

WHEELS: Final = ("fl", "rl", "fr", "rr")
"""Wheel order everywhere."""

GEOMETRY_UNITS: Final = {
    "wheelbase": "m",
    "track_width": "m",
    "wheel_offset": "m",
    "wheel_radius": "m",
    "gear_ratio": "1",
    "steering_limit": "rad",
}


@dataclass(frozen=True)
class Geometry:
    """What a tape measure finds.

    Attributes:
        wheelbase: l, between front and rear steering axes [m].
        track_width: b, between left and right steering axes [m].
        wheel_offset: a, from steering axis to wheel contact along the wheel's axle, outward [m].
        wheel_radius: r [m].
        gear_ratio: i_G, motor turns per wheel turn [-].
        steering_limit: mechanical stop of the steering angles, either side [rad].
    """

    wheelbase: float
    track_width: float
    wheel_offset: float
    wheel_radius: float
    gear_ratio: float
    steering_limit: float = math.pi / 2 + 0.05

    @property
    def lever_ratio(self) -> float:
        """a/r: wheel rolling per steering motion at standstill [-]."""
        return self.wheel_offset / self.wheel_radius

    @property
    def rotation_angle(self) -> float:
        """Steering angle arctan(l/b) of pure rotation, mode 4 of (9) [rad]."""
        return math.atan2(self.wheelbase, self.track_width)

    @property
    def rotation_lever(self) -> float:
        """Distance of the wheel contacts from the centre in mode 4 [m]."""
        return math.hypot(self.wheelbase, self.track_width) / 2 + self.wheel_offset

    @property
    def footprint(self) -> tuple[float, float]:
        """Length and width that the wheels sweep at standstill [m], paper section 6.2."""
        diagonal = math.hypot(self.wheelbase, self.track_width) + 2 * self.wheel_offset
        return diagonal, diagonal

    def as_vector(self) -> NDArray[np.float64]:
        """(l, b, a, r, i_G), the order of the symbolic model."""
        return np.array([self.wheelbase, self.track_width, self.wheel_offset, self.wheel_radius, self.gear_ratio])


def read_geometry(table: Mapping[str, Any], path: Path) -> Geometry:
    """Geometry from the table [geometry] of a vehicle file.

    Raises:
        DataFileError: an entry is missing, in another unit, or cannot be.
    """
    quantities = read_quantities(table, GEOMETRY_UNITS, f"{path}: geometry")
    geometry = Geometry(**{name: quantity.value for name, quantity in quantities.items()})
    check_geometry(geometry, path)
    return geometry


def geometry_text(geometry: Geometry, source: str) -> str:
    """TOML: the table that `read_geometry` reads."""
    lines = ["", "[geometry]"]
    for name, unit in GEOMETRY_UNITS.items():
        value = float(getattr(geometry, name))
        lines.append(f'{name} = {{ value = {value!r}, unit = "{unit}", source = {json.dumps(source)} }}')
    return "\n".join(lines) + "\n"


def check_geometry(geometry: Geometry, path: Path) -> None:
    """Refuse a geometry that no vehicle can have.

    Raises:
        DataFileError: with the entry and the bound it breaks.
    """
    lengths = ("wheelbase", "track_width", "wheel_offset", "wheel_radius", "gear_ratio")
    for name in lengths:
        if getattr(geometry, name) <= 0:
            raise DataFileError(
                f"{path}: geometry.{name} = {getattr(geometry, name)} cannot be.", "It must be positive."
            )
    half_diagonal = math.hypot(geometry.wheelbase, geometry.track_width) / 2
    if geometry.wheel_offset > half_diagonal / 2:
        raise DataFileError(
            f"{path}: geometry.wheel_offset = {geometry.wheel_offset} m is not small against the half "
            f"diagonal {half_diagonal:.3f} m, which the model assumes (paper, section 4).",
            "Check the lengths and their units.",
        )
    if 2 * geometry.wheel_radius > geometry.wheelbase:
        raise DataFileError(
            f"{path}: geometry.wheel_radius = {geometry.wheel_radius} m lets front and rear wheels overlap "
            f"at a wheelbase of {geometry.wheelbase} m.",
            "Check the lengths and their units.",
        )
    if not geometry.rotation_angle <= geometry.steering_limit <= math.pi:
        raise DataFileError(
            f"{path}: geometry.steering_limit = {geometry.steering_limit} rad does not reach the rotation "
            f"angle arctan(l/b) = {geometry.rotation_angle:.3f} rad, or exceeds pi.",
            "Give the angle of the mechanical stop in rad.",
        )

"""Regions in which the gap is counted, and the states that an unknown cause might depend on."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.vehicle.records.inputs import SLICES
from ident.estimate.equations import RowsOfStep
from ident.plant.modes import Mode
from ident.vehicle.geometry import WHEELS, Geometry

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SLOW: Final = 0.25
"""Share of its largest speed below which a coordinate counts as slow, and of its load as lightly loaded."""


def coordinate_motion(inputs: Array, spec: RowsOfStep, coordinate: str, geometry: Geometry) -> list[Array]:
    """Position, rate and acceleration (N,) of the coordinate of a row, or of the wheel or side that it is about."""
    if spec.mode is None or spec.mode is Mode.ALIGNMENT:
        name, index = _joint(coordinate)
        return [inputs[:, SLICES[key].start + index] for key in _KEYS[name]]
    lever = np.array(_ROLLING[spec.mode]) * geometry.wheel_radius / 4
    return [inputs[:, SLICES[key]] @ lever for key in _KEYS["beta"]]


_KEYS: Final = {
    "alpha": ("alpha", "alpha_rate", "alpha_acceleration"),
    "beta": ("beta", "beta_rate", "beta_acceleration"),
}
_ROLLING: Final = {Mode.STEERED: (1, 1, 1, 1), Mode.ROTATION: (-1, -1, 1, 1), Mode.LATERAL: (-1, 1, 1, -1)}


def _joint(coordinate: str) -> tuple[str, int]:
    """Name and index of the joint that a row is about: a wheel in the air or at rest, or the steering of a side."""
    if coordinate.startswith(("beta_", "rest_")):
        return "beta", WHEELS.index(coordinate[-2:])
    return "alpha", 0 if coordinate.endswith("l") else 1


def regions_of(position: Array, rate: Array, acceleration: Array, load: Array) -> Mapping[str, Mask]:
    """Masks (N,) by name; they overlap."""
    speed, pull = np.abs(rate), np.abs(load)
    middle = (position.max() + position.min()) / 2
    early = np.arange(len(rate)) < len(rate) / 2
    return {
        "low_speed": speed < SLOW * speed.max(),
        "high_speed": speed >= (1 - SLOW) * speed.max(),
        "forward": rate > 0,
        "backward": rate < 0,
        "speeding_up": rate * acceleration > 0,
        "braking": rate * acceleration < 0,
        "ahead": position > middle,
        "behind": position < middle,
        "high_load": pull >= (1 - SLOW) * pull.max(),
        "early": early,
        "late": ~early,
    }


def features_of(position: Array, rate: Array, acceleration: Array, load: Array) -> Array:
    """(N, 4): position, speed, acceleration and generalized load."""
    return np.stack([position, rate, acceleration, load], axis=1)

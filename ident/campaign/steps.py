"""The steps of a campaign as a table: order, mode, driven coordinate, period, room."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.records.record import Step
from ident.vehicle.geometry import Geometry
from ident.vehicle.modes import Mode

Array = NDArray[np.float64]


class Posture(enum.Enum):
    """Steering angles in which a step is driven."""

    AHEAD = "ahead"
    ACROSS = "across"
    ROTATION = "rotation"

    def angles(self, geometry: Geometry) -> Array:
        """(α_l, α_r) [rad]."""
        size = {Posture.AHEAD: 0.0, Posture.ACROSS: math.pi / 2, Posture.ROTATION: geometry.rotation_angle}[self]
        return np.array([-size, size])


@dataclass(frozen=True)
class StepSpec:
    """An excitation step.

    Attributes:
        step: its name in records.
        mode: k of (9), None for wheels in the air.
        coordinate: the generalized coordinate driven.
        posture: steering angles at its start.
        period: of the excitation [s].
        harmonics: number of harmonics.
        stroke: largest excursion of the coordinate from its start [rad or m].
        speed: largest speed of the coordinate [rad/s or m/s].
        acceleration: largest acceleration of the coordinate.
        repeats: periods of this step per period asked of a campaign: steering friction is the noisiest.
    """

    step: str
    mode: Mode | None
    coordinate: str
    posture: Posture
    period: float
    harmonics: int
    stroke: float
    speed: float
    acceleration: float
    repeats: float = 1.0

    def steering(self, geometry: Geometry) -> Array:
        """Steering angles at the start of the step (2,) [rad]."""
        return self.posture.angles(geometry)


_SPECS: Final = (
    StepSpec(Step.WHEEL_LIFTED, None, "beta", Posture.AHEAD, 4.0, 6, 8.0, 12.0, 120.0),
    StepSpec(Step.STEERING_LEFT, Mode.ALIGNMENT, "alpha_l", Posture.AHEAD, 5.0, 6, 1.3, 5.0, 40.0, 1.5),
    StepSpec(Step.STEERING_RIGHT, Mode.ALIGNMENT, "alpha_r", Posture.AHEAD, 5.0, 6, 1.3, 5.0, 40.0, 1.5),
    StepSpec(Step.STRAIGHT, Mode.STEERED, "x", Posture.AHEAD, 8.0, 6, 1.0, 1.2, 2.0),
    StepSpec(Step.ROTATION, Mode.ROTATION, "gamma", Posture.ROTATION, 8.0, 6, 1.2, 1.4, 2.5),
    StepSpec(Step.LATERAL, Mode.LATERAL, "y", Posture.ACROSS, 8.0, 6, 0.8, 1.0, 2.0),
)
EXCITATIONS: Final[Mapping[str, StepSpec]] = MappingProxyType({spec.step: spec for spec in _SPECS})
"""Excitation steps in the order in which they are driven."""

ORDER: Final = (
    Step.WHEEL_LIFTED,
    Step.STEERING_LEFT,
    Step.STEERING_RIGHT,
    Step.STRAIGHT,
    Step.ROTATION,
    Step.LATERAL,
    Step.LANE_CHANGE,
)
"""Order of a campaign; an alignment is driven wherever the next step needs other steering angles."""

PERIODS: Final = 4
"""Repeats of an excitation, at least."""

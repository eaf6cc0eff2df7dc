"""The steps of a campaign as a table: order, mode, driven coordinate, period, room."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ident.plant.modes import Mode
from ident.records.record import Step
from ident.vehicle.geometry import Geometry

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
        like: step whose excitation it takes over; its own where empty.
        turn: angle by which it turns the vehicle on the spot, instead of an excitation [rad].
        dithers: torques that move nothing are added, see `ident.campaign.dither`.
        loaded: driven with a known payload.
        reversed: driven when the vehicle has been turned round.
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
    like: str = ""
    turn: float = 0.0
    dithers: bool = False
    loaded: bool = False
    reversed: bool = False

    @property
    def optimised(self) -> bool:
        """Whether it has an excitation of its own."""
        return not self.like and not self.turn

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


def _variant(base: Step, name: str, **changes: Any) -> StepSpec:
    return replace(EXCITATIONS[base], step=f"{base}_{name}", **changes)


def _again(base: Step, name: str, **changes: Any) -> StepSpec:
    """A variant with the very motion of its base, so that what differs is not the motion."""
    return _variant(base, name, like=str(base), **changes)


_DIAGNOSTIC: Final = (
    _variant(Step.STEERING_LEFT, "slow", period=8.0, speed=0.6, repeats=1.0),
    _variant(Step.STEERING_RIGHT, "slow", period=8.0, speed=0.6, repeats=1.0),
    _variant(Step.STRAIGHT, "slow", period=10.0, speed=0.2),
    _again(Step.STRAIGHT, "dither", dithers=True),
    _variant(Step.ROTATION, "wide", period=12.0, stroke=2.8),
    _variant(Step.ROTATION, "turn", turn=math.pi),
    _again(Step.STRAIGHT, "turned", reversed=True),
    _variant(Step.ROTATION, "turn_back", turn=-math.pi),
    _again(Step.STRAIGHT, "loaded", loaded=True),
    _again(Step.ROTATION, "loaded", loaded=True),
)
DIAGNOSTIC: Final[Mapping[str, StepSpec]] = MappingProxyType(
    {**EXCITATIONS, **{spec.step: spec for spec in _DIAGNOSTIC}}
)
"""All excitation steps, those of a diagnosis among them; each is a variant of the step that it is named after."""

DRIVING_ORDER: Final[tuple[str, ...]] = (
    Step.WHEEL_LIFTED,
    Step.STEERING_LEFT,
    "steering_left_slow",
    Step.STEERING_RIGHT,
    "steering_right_slow",
    Step.STRAIGHT,
    "straight_slow",
    "straight_dither",
    Step.ROTATION,
    "rotation_wide",
    "rotation_turn",
    "straight_turned",
    "rotation_turn_back",
    Step.LATERAL,
    "straight_loaded",
    "rotation_loaded",
    Step.LANE_CHANGE,
)
"""Order of all steps; an alignment is driven wherever the next step needs other steering angles."""

ORDER: Final = tuple(Step(step) for step in DRIVING_ORDER if step in tuple(Step))
"""The steps of a campaign that is not asked for those of a diagnosis."""

LOADED: Final = tuple(spec.step for spec in _DIAGNOSTIC if spec.loaded)
"""The steps that need a payload."""

PERIODS: Final = 4
"""Repeats of an excitation, at least."""

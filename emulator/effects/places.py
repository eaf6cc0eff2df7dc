"""Places of effects in the emulator: joints, wheels, drives, encoders, and all of a kind."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

STEERING: Final = ("steering_left", "steering_right")
WHEELS: Final = ("wheel_fl", "wheel_rl", "wheel_fr", "wheel_rr")
DRIVES: Final = ("drive_fl", "drive_rl", "drive_fr", "drive_rr")
ENCODERS: Final = ("encoder_left", "encoder_right")
CHASSIS: Final = ("chassis",)

_ALL: Final[Mapping[str, tuple[str, ...]]] = MappingProxyType(
    {"steering": STEERING, "wheels": WHEELS, "drives": DRIVES, "encoders": ENCODERS}
)

JOINTS: Final = (*STEERING, "steering", *WHEELS, "wheels")
"""Both sides of the steering and the four wheels, each or all of a kind."""

EACH_WHEEL: Final = (*WHEELS, "wheels")
EACH_DRIVE: Final = (*DRIVES, "drives")
EACH_ENCODER: Final = (*ENCODERS, "encoders")
EACH_SIDE: Final = (*STEERING, "steering")

_FRICTION: Final[Mapping[str, tuple[str, str]]] = MappingProxyType(
    {"steering_left": ("d_vl", "d_cl"), "steering_right": ("d_vr", "d_cr")}
)

_STEERING_JOINTS = (0, 2)
_ROLLING = 4


@dataclass(frozen=True)
class JointAxis:
    """A joint and the sense in which it counts as forward.

    Attributes:
        joint: index of the engine.
        sign: +1, or -1 for the rear steering units, which turn against the front ones.
        share: of the effect at its place that this joint carries.
    """

    joint: int
    sign: float
    share: float


def each(where: str) -> tuple[str, ...]:
    """The single places that a place is."""
    return _ALL.get(where, (where,))


def joint_axes(where: str) -> tuple[JointAxis, ...]:
    """The joints of a steering side (half the effect on each unit) or of a wheel."""
    if where in STEERING:
        front = _STEERING_JOINTS[STEERING.index(where)]
        return JointAxis(front, 1.0, 0.5), JointAxis(front + 1, -1.0, 0.5)
    return (JointAxis(_ROLLING + wheel_index(where), 1.0, 1.0),)


def friction_symbols(where: str) -> tuple[str, str]:
    """Viscous and Coulomb friction of a steering side or a wheel, by their symbols."""
    return _FRICTION.get(where, ("d_vw", "d_cw"))


def wheel_index(where: str) -> int:
    """0 to 3 for the ending fl, rl, fr, rr of a place."""
    return ("fl", "rl", "fr", "rr").index(where.rpartition("_")[2])


def side_index(where: str) -> int:
    """0 or 1 for the ending left, right of a place."""
    return ("left", "right").index(where.rpartition("_")[2])


def wheels_of(where: str) -> tuple[int, ...]:
    """Wheels of a wheel, a drive, a side or the vehicle."""
    sides = {"chassis": (0, 1, 2, 3), "steering_left": (0, 1), "steering_right": (2, 3)}
    return sides.get(where) or (wheel_index(where),)

"""What an effect may do at an engine step: joint torques, dry friction, a force on the chassis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from emulator.engine import Engine


@dataclass
class Moment:
    """The present engine step; laws change `torques` and `coulomb` in place.

    Joints are numbered as in the engine: steering fl, rl, fr, rr, then rolling fl, rl, fr, rr.

    Attributes:
        time: [s].
        engine: to read the chassis and to push it.
        angles: (8,) of the joints [rad].
        rates: (8,) of the joints [rad/s].
        torques: (8,) on the joints in this step [Nm].
        drive_torques: (4,) what of them comes from the drives [Nm].
        coulomb: (8,) largest torque of dry friction in this step [Nm].
    """

    time: float
    engine: Engine
    angles: Sequence[float]
    rates: Sequence[float]
    torques: list[float]
    drive_torques: Sequence[float]
    coulomb: list[float]


class Law(Protocol):
    """Physics beyond the prototype's, evaluated every engine step."""

    def __call__(self, moment: Moment) -> None:
        """Add torques, change friction, push the chassis."""


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


_STEERING = (0, 2)
_ROLLING = 4


def joint_axes(where: str) -> tuple[JointAxis, ...]:
    """The joints of a steering side (half the effect on each unit), of a wheel, or of all wheels."""
    if where.startswith("steering"):
        front = _STEERING[where == "steering_right"]
        return JointAxis(front, 1.0, 0.5), JointAxis(front + 1, -1.0, 0.5)
    wheels = range(4) if where == "wheels" else (wheel_index(where),)
    return tuple(JointAxis(_ROLLING + wheel, 1.0, 1.0) for wheel in wheels)


def wheel_index(where: str) -> int:
    """0 to 3 for the ending fl, rl, fr, rr of a place."""
    return ("fl", "rl", "fr", "rr").index(where.rpartition("_")[2])


def side_index(where: str) -> int:
    """0 or 1 for the ending left, right of a place."""
    return ("left", "right").index(where.rpartition("_")[2])

"""What an effect may do at an engine step: joint torques, dry friction, a force on the chassis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from emulator.engine.protocol import Engine


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

"""What an axis does at present, and the clock of the drive's own loops."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from emulator.firmware.drive.axis import TICK, Axis
from emulator.firmware.drive.homing import Homing
from emulator.firmware.drive.modes import (
    CyclicTorque,
    CyclicVelocity,
    Mode,
    Motion,
    NoMotion,
    ProfileTorque,
    ProfileVelocity,
)
from emulator.firmware.drive.positioning import CyclicPosition, ProfilePosition
from emulator.firmware.timers import Timer, Timers


def make_motions(axis: Axis) -> Mapping[Mode, Motion]:
    """What the axis does in each mode of operation."""
    return {
        Mode.NONE: NoMotion(axis),
        Mode.PROFILE_POSITION: ProfilePosition(axis),
        Mode.PROFILE_VELOCITY: ProfileVelocity(axis),
        Mode.PROFILE_TORQUE: ProfileTorque(axis),
        Mode.HOMING: Homing(axis),
        Mode.CYCLIC_POSITION: CyclicPosition(axis),
        Mode.CYCLIC_VELOCITY: CyclicVelocity(axis),
        Mode.CYCLIC_TORQUE: CyclicTorque(axis),
    }


class Activity:
    """Runs one motion at a time; no timer where it needs none.

    Args:
        timers: simulated time.
        tick: called every period of the loops while a motion runs that needs them.

    Attributes:
        motion: what runs, None without power.
    """

    def __init__(self, timers: Timers, tick: Callable[[Motion], None]) -> None:
        self._timers = timers
        self._tick = tick
        self._timer: Timer | None = None
        self.motion: Motion | None = None

    def run(self, motion: Motion | None) -> None:
        """From now on do `motion`."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        self.motion = motion
        if motion is not None:
            motion.start()
            if motion.ticks:
                self._timer = self._timers.after(TICK, self._due)

    def _due(self) -> None:
        motion = self.motion
        if motion is not None:
            self._timer = self._timers.after(TICK, self._due)
            self._tick(motion)

"""The demand of cyclic synchronous position: a line to each set-point, within the limits of speed and acceleration."""

from __future__ import annotations

import math
from dataclasses import dataclass

from emulator.firmware.drive.axis import TICK, approach
from emulator.firmware.drive.modes import Interpolation


@dataclass(frozen=True)
class Limits:
    """What a demand may do.

    Attributes:
        speed: the lower one of 607Fh and 6080h [increments / s].
        acceleration, deceleration: 60C5h, 60C6h [increments / s^2].
        period: 60C2h [s].
    """

    speed: float
    acceleration: float
    deceleration: float
    period: float

    def clip(self, slope: float) -> float:
        """A slope within the limit of speed [increments / s]."""
        return min(max(slope, -self.speed), self.speed)

    def rate(self, last: float, slope: float) -> float:
        """Limit of the change from one slope to another [increments / s^2]."""
        slows = abs(slope) < abs(last) or slope * last < 0.0
        return self.deceleration if slows else self.acceleration

    def braking(self, distance: float) -> float:
        """Highest speed from which the demand still stops within `distance` [increments / s]."""
        half = self.deceleration * TICK / 2.0
        return math.sqrt(half**2 + 2.0 * self.deceleration * abs(distance)) - half


class Tracking:
    """Slope of the position demand.

    Set-points that ask for no more than the limits are reached on straight lines, each over the interpolation time.
    After one that asks for more, the demand follows the set-points as fast as it may, and meets them without passing.
    """

    def __init__(self) -> None:
        self._line = Interpolation()
        self._aim = 0.0
        self.slope = 0.0

    def start(self, slope: float) -> None:
        """From a present slope [increments / s], with no set-point so far."""
        self._aim = 0.0
        self.slope = slope

    def begin(self, period: float) -> None:
        """Something has come that the line has to begin anew for."""
        self._line.begin(period)

    def set_point(self, step: float | None, period: float) -> None:
        """A set-point has come, `step` [increments] beyond the one before, None where there was none."""
        self._aim = 0.0 if step is None else step / max(period, TICK)

    def rest(self, limits: Limits) -> float:
        """The slope of the next tick where there is no set-point: to a stop."""
        self.slope = approach(self.slope, 0.0, limits.deceleration * TICK)
        return self.slope

    def step(self, distance: float, limits: Limits) -> tuple[float, bool]:
        """The slope of the next tick towards a set-point [increments / s], and whether it is what was asked for.

        Args:
            distance: of the set-point from the demand [increments].
            limits: what the demand may do.
        """
        if self._line.left == 0:
            # No set-point came in time: as far as is known, it stands.
            self._aim = 0.0
        # Where the line of the set-points is now, which will be at the last of them at the end of its time.
        gap = distance - self._aim * self._line.left * TICK
        asked = self._line.step(distance) / TICK
        self.slope = self._within(asked, gap, limits)
        return self.slope, self.slope == asked

    def _within(self, asked: float, gap: float, limits: Limits) -> float:
        last, line = self.slope, limits.clip(asked)
        aim, braking = limits.clip(self._aim), limits.braking(gap)
        # The slope of a line changes once an interpolation time.
        change = max(limits.period, TICK)
        follows = abs(line - last) <= limits.rate(last, line) * change
        if follows and abs(line - aim) <= max(braking, limits.deceleration * change):
            return line
        wanted = limits.clip(aim + math.copysign(min(braking, abs(gap) / TICK), gap))
        return approach(last, wanted, limits.rate(last, wanted) * TICK)

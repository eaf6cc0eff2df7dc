"""Flaws of the steering encoders: an offset, a delay."""

from __future__ import annotations

from dataclasses import dataclass

from emulator.effects.drives import DelayLine
from emulator.engine.protocol import Engine


@dataclass(frozen=True)
class EncoderFlaws:
    """Of the steering encoder of one side.

    Attributes:
        offset: angle reported minus true angle [rad].
        delay: time by which the angle is reported later [s].
    """

    offset: float = 0.0
    delay: float = 0.0


class SensedSteering:
    """The steering angles as the sensors take them.

    Args:
        engine: the true angles.
        flaws: of the left and the right encoder.
    """

    def __init__(self, engine: Engine, flaws: tuple[EncoderFlaws, EncoderFlaws]) -> None:
        self._engine = engine
        self._flaws = flaws
        self._lines = [DelayLine(flaw.delay, engine.step_size) if flaw.delay else None for flaw in flaws]
        self.settle()

    def settle(self) -> None:
        """The vehicle has been at rest for longer than any delay."""
        for side, line in enumerate(self._lines):
            if line is not None:
                line.fill(self._engine.steering_angle(side))

    def true_angle(self, side: int, sensed: float, rate: float) -> float:
        """Angle of a side [rad] that is sensed as `sensed` while it turns at `rate` [rad/s]."""
        return sensed - self._flaws[side].offset + rate * self._flaws[side].delay

    def move_on(self, rates: tuple[float, float]) -> None:
        """Both sides have turned at these rates [rad/s] for longer than any delay."""
        step = self._engine.step_size
        for side, (line, rate) in enumerate(zip(self._lines, rates, strict=True)):
            if line is not None:
                now, entries = self._engine.steering_angle(side), round(line.delay / step) + 2
                for back in range(entries, -1, -1):
                    line.push(now - back * step * rate)

    def advance(self) -> None:
        """Take note of the angles at the end of an engine step."""
        for side, line in enumerate(self._lines):
            if line is not None:
                line.push(self._engine.steering_angle(side))

    def steering_angle(self, side: int) -> float:
        """Angle of a side as sensed [rad]."""
        line = self._lines[side]
        angle = self._engine.steering_angle(side) if line is None else line.value()
        return angle + self._flaws[side].offset

"""Plausibility of the motor encoder: a count that the shaft cannot have reached, or that stays when it must not."""

from __future__ import annotations

from typing import Final

from emulator.firmware.drive.axis import wrap

_SPEED_MARGIN: Final = 2.0
"""Times the highest motor speed that a reading may suggest [-]: slopes and collisions drive a motor too."""

_SHAFT_MARGIN: Final = 0.02
"""Revolutions on top of it [-]."""

_STUCK_TIME: Final = 0.05
"""Time for which a count may be exactly the same under torque [s]: the last digit of a living encoder flickers."""

_STUCK_TORQUE: Final = 1000
"""Torque demand from which on it must not [per mille of rated torque]: up to it a blocked shaft is no fault, and may
hold its count by chance."""


class EncoderWatch:
    """Compares each count with the one before.

    Args:
        counts: increments per revolution of the motor.
    """

    def __init__(self, counts: int) -> None:
        self._margin = _SHAFT_MARGIN * counts
        self._last: int | None = None
        self._time = 0.0
        self._same_since = 0.0

    def reset(self) -> None:
        """Begin anew with the next count."""
        self._last = None

    def accepts(self, count: int, now: float, speed: float, torque: int) -> bool:
        """Whether a count can be true.

        Args:
            count: of the encoder [increments], 32 bits.
            now: instant of the reading [s].
            speed: highest speed of the motor [increments / s].
            torque: demand [per mille of rated torque].
        """
        last, elapsed = self._last, now - self._time
        self._last, self._time = count, now
        if last is None or count != last or -_STUCK_TORQUE < torque < _STUCK_TORQUE:
            self._same_since = now
        if last is None or count == last:
            return now - self._same_since < _STUCK_TIME
        return abs(wrap(count - last)) <= self._margin + _SPEED_MARGIN * speed * elapsed

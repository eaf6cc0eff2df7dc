"""What a running drive looks after: thermal load, and counts of the motor encoder that cannot be true."""

from __future__ import annotations

from typing import Final

from emulator.firmware.drive.axis import Axis, wrap
from emulator.firmware.drive.parameters import Parameters
from emulator.firmware.hardware import DriveHardware

_WARNING_LOAD: Final = 0.9
"""I2t load from which on bit 7 warns [-]; the protection responds at 1.05."""

_SPEED_MARGIN: Final = 2.0
"""Times the highest motor speed that a reading may suggest [-]: slopes and collisions drive a motor too."""

_SHAFT_MARGIN: Final = 0.02
"""Revolutions on top of it [-]."""

_STUCK_TIME: Final = 0.05
"""Time for which a count may be exactly the same under torque [s]: the last digit of a living encoder flickers."""

_STUCK_TORQUE: Final = 1000
"""Torque demand from which on it must not [per mille of rated torque]: up to it a blocked shaft is no fault, and may
hold its count by chance."""


class Supervision:
    """Looks after one drive.

    Args:
        axis, hardware, parameters: of it.

    Attributes:
        warns: the thermal load is near to its limit.
    """

    def __init__(self, axis: Axis, hardware: DriveHardware, parameters: Parameters) -> None:
        self._axis = axis
        self._hardware = hardware
        self._parameters = parameters
        self._encoder = EncoderWatch(hardware.counts_per_revolution)
        self._looked_at = 0.0
        self.warns = False

    def reset(self) -> None:
        """Begin anew with the next count."""
        self._encoder.reset()

    def passes(self) -> bool:
        """Look once: whether the encoder can be believed."""
        axis = self._axis
        if axis.read_at == self._looked_at:
            # Nobody has asked for the position since the last time.
            axis.position()
        self._looked_at = axis.read_at
        speed = self._parameters.max_motor_speed * axis.increments
        accepted = self._encoder.accepts(axis.count, axis.read_at, speed, axis.torque_demand)
        if accepted:
            self.warns = self._hardware.thermal_load > _WARNING_LOAD
        return accepted


class EncoderWatch:
    """Compares each count with the one before: one that the shaft cannot have reached, or that stays when it must not.

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

"""Parameters of the drive profile in SI units, kept up to date with the object dictionary."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import Final

from emulator.firmware.dictionary import Dictionary

_Scale = Callable[[float], float]

_RPM: Final = math.tau / 60.0


def _of_objects(counts: float) -> Mapping[str, tuple[int, int, _Scale]]:
    """Attribute -> index, sub-index, and raw value to SI; `counts` are the increments of a revolution."""
    angle = math.tau / counts
    return {
        "following_window": (0x6065, 0, float),
        "following_time": (0x6066, 0, lambda ms: ms * 1e-3),
        "position_window": (0x6067, 0, float),
        "position_window_time": (0x6068, 0, lambda ms: ms * 1e-3),
        "velocity_window": (0x606D, 0, lambda raw: raw * angle),
        "velocity_window_time": (0x606E, 0, lambda ms: ms * 1e-3),
        "velocity_threshold": (0x606F, 0, lambda raw: raw * angle),
        "velocity_threshold_time": (0x6070, 0, lambda ms: ms * 1e-3),
        "max_profile_velocity": (0x607F, 0, lambda raw: raw * angle),
        "max_motor_speed": (0x6080, 0, lambda rpm: rpm * _RPM),
        "profile_velocity": (0x6081, 0, lambda raw: raw * angle),
        "acceleration": (0x6083, 0, lambda raw: raw * angle),
        "deceleration": (0x6084, 0, lambda raw: raw * angle),
        "quick_stop_deceleration": (0x6085, 0, lambda raw: raw * angle),
        "torque_slope": (0x6087, 0, float),
        "home_offset": (0x607C, 0, float),
        "homing_method": (0x6098, 0, float),
        "homing_speed": (0x6099, 2, lambda raw: raw * angle),
        "homing_acceleration": (0x609A, 0, lambda raw: raw * angle),
        "interpolation_value": (0x60C2, 1, float),
        "interpolation_exponent": (0x60C2, 2, float),
        "max_acceleration": (0x60C5, 0, lambda raw: raw * angle),
        "max_deceleration": (0x60C6, 0, lambda raw: raw * angle),
        "velocity_gain": (0x60F9, 1, lambda raw: raw * 1e-6),
        "velocity_integration_time": (0x60F9, 2, lambda raw: raw * 1e-4),
        "load_inertia": (0x60F9, 3, lambda raw: raw * 1e-9),
        "position_gain": (0x60FB, 1, lambda raw: raw * 1e-2),
    }


_OPTIONAL: Final[Mapping[str, tuple[int, int, int]]] = {
    "lowest_position": (0x607D, 1, -(2**31)),
    "highest_position": (0x607D, 2, 2**31 - 1),
    "polarity": (0x607E, 0, 0),
    "positioning_options": (0x60F2, 0, 0),
}
"""Attribute -> index, sub-index, and what holds where the EDS does not have the object."""

_POSITION_REVERSED: Final = 1 << 7
_VELOCITY_REVERSED: Final = 1 << 6

POLARITY_BITS: Final = _POSITION_REVERSED | _VELOCITY_REVERSED
"""The bits of 607Eh that there are."""

_TORQUE_LIMITS: Final = (0x6072, 0x6073, 0x60E0, 0x60E1)
"""In per mille of rated torque or current, which are proportional."""


class Parameters:
    """The parameters that motion control reads every millisecond.

    Angles at the motor shaft in rad unless in increments; times in s; limits of torque in per mille of 6076h.

    Attributes:
        following_window: 6065h [increments]; the largest value switches the monitoring off.
        position_window: 6067h [increments].
        torque_slope: 6087h [per mille / s].
        home_offset: 607Ch [increments].
        lowest_position, highest_position: 607Dh [increments], counted from the home position.
        polarity: 607Eh.
        positioning_options: 60F2h.
        highest_torque, lowest_torque: what 6072h, 6073h, 60E0h and 60E1h leave [per mille].

    Args:
        dictionary: the object dictionary of the node.
        counts: encoder increments per revolution of the motor.
    """

    following_window: float
    following_time: float
    position_window: float
    position_window_time: float
    velocity_window: float
    velocity_window_time: float
    velocity_threshold: float
    velocity_threshold_time: float
    max_profile_velocity: float
    max_motor_speed: float
    profile_velocity: float
    acceleration: float
    deceleration: float
    quick_stop_deceleration: float
    torque_slope: float
    home_offset: float
    homing_method: float
    homing_speed: float
    homing_acceleration: float
    interpolation_value: float
    interpolation_exponent: float
    max_acceleration: float
    max_deceleration: float
    velocity_gain: float
    velocity_integration_time: float
    load_inertia: float
    position_gain: float
    lowest_position: int
    highest_position: int
    polarity: int
    positioning_options: int

    def __init__(self, dictionary: Dictionary, counts: int) -> None:
        self._dictionary = dictionary
        self._objects = _of_objects(counts)
        self._limits = dict.fromkeys(_TORQUE_LIMITS, 0)
        self.highest_torque = self.lowest_torque = 0
        for name, (index, subindex, scale) in self._objects.items():
            dictionary.on_change(index, subindex, self._setter(name, scale))
        for name, (index, subindex, _) in _OPTIONAL.items():
            dictionary.on_change(index, subindex, partial(setattr, self, name))
        for index in _TORQUE_LIMITS:
            dictionary.on_change(index, 0, self._limiter(index))
        self.load()

    def load(self) -> None:
        """Take all values from the dictionary, as after a reset."""
        for name, (index, subindex, scale) in self._objects.items():
            setattr(self, name, scale(self._dictionary.value(index, subindex)))
        for name, (index, subindex, otherwise) in _OPTIONAL.items():
            setattr(self, name, self._dictionary.value(index, subindex, default=otherwise))
        for index in _TORQUE_LIMITS:
            self._limiter(index)(self._dictionary.value(index))

    @property
    def position_sign(self) -> int:
        """What positions of the objects have to be multiplied with to be those of the motor (607Eh, bit 7)."""
        return -1 if self.polarity & _POSITION_REVERSED else 1

    @property
    def velocity_sign(self) -> int:
        """The same of velocities (607Eh, bit 6)."""
        return -1 if self.polarity & _VELOCITY_REVERSED else 1

    @property
    def interpolation_time(self) -> float:
        """60C2h: time between set-points in the cyclic modes [s]."""
        return float(self.interpolation_value * 10.0**self.interpolation_exponent)

    @property
    def profile_speed(self) -> float:
        """The lower one of 607Fh and 6080h [rad/s]."""
        return min(self.max_profile_velocity, self.max_motor_speed)

    def _setter(self, name: str, scale: _Scale) -> Callable[[int], None]:
        return lambda value: setattr(self, name, scale(value))

    def _limiter(self, index: int) -> Callable[[int], None]:
        def limit(value: int) -> None:
            self._limits[index] = value
            torque, current, positive, negative = self._limits.values()
            self.highest_torque = min(torque, current, positive)
            self.lowest_torque = -min(torque, current, negative)

        return limit

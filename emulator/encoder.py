"""Finite increments: what a shaft encoder makes of an angle."""

from __future__ import annotations

import math
from typing import Final, Protocol

from emulator.noise import Disturbances
from emulator.prototype import EncoderData

_SPAN: Final = 1 << 32
_HALF_SPAN: Final = 1 << 31


def wrap_unsigned(count: int) -> int:
    """`count` in an unsigned 32-bit register."""
    return count % _SPAN


def wrap_signed(count: int) -> int:
    """`count` in a signed 32-bit register."""
    return (count + _HALF_SPAN) % _SPAN - _HALF_SPAN


class SteeringAngles(Protocol):
    """The steering angles as the encoders take them."""

    def steering_angle(self, side: int) -> float:
        """Of the front wheel of a side (0 left, 1 right) [rad]."""


class Encoder:
    """Steering encoder of one side, on the front unit's steering axis."""

    def __init__(self, data: EncoderData, side: int, angles: SteeringAngles, disturbances: Disturbances) -> None:
        self.counts_per_revolution = data.counts_per_revolution
        self._scale = data.directions[side] * data.counts_per_revolution / math.tau
        self._zero = data.zero_positions[side]
        self._side = side
        self._angles = angles
        self._disturbances = disturbances

    def position(self) -> int:
        """Position value [increments], unsigned 32 bit; `zero_positions` with the wheels straight."""
        exact = self._scale * self._angles.steering_angle(self._side)
        dither = self._disturbances.steering_dither[self._side]
        return wrap_unsigned(self._zero + round(exact + dither))

"""Homing mode of CiA 402-2, with the methods that make sense on a wheel: no end of travel, no home switch."""

from __future__ import annotations

import math
from enum import Enum, auto
from typing import Final

from emulator.firmware.drive.axis import TICK, Axis, approach
from emulator.firmware.drive.modes import HOMING_ATTAINED, TARGET_REACHED, Steady

_START: Final = 1 << 4
"""Bit 4 of the controlword: the rising edge starts homing, low interrupts it."""

NEGATIVE_INDEX, POSITIVE_INDEX = 33, 34
PRESENT_POSITION: Final = (35, 37)
METHODS: Final = (0, NEGATIVE_INDEX, POSITIVE_INDEX, *PRESENT_POSITION)
"""Values of 6098h: none; index pulse in negative or positive direction, whatever 607Eh says; where the shaft is now."""


class _Phase(Enum):
    IDLE = auto()
    SEARCHING = auto()
    STOPPING = auto()
    DONE = auto()


_BITS: Final = {
    _Phase.IDLE: TARGET_REACHED,
    _Phase.SEARCHING: 0,
    _Phase.STOPPING: HOMING_ATTAINED,
    _Phase.DONE: HOMING_ATTAINED | TARGET_REACHED,
}


class Homing:
    """Gives the position counter its zero: afterwards 6064h is 607Ch at the home position.

    The index pulse is the zero of the motor encoder, once in a revolution.
    """

    ticks, failed = True, False

    def __init__(self, axis: Axis) -> None:
        self._axis = axis
        self._phase = _Phase.IDLE
        self._started = False
        self._turn = 0
        self._rest = Steady()

    def start(self) -> None:
        """Stand and wait for bit 4 to rise: one that is high already has started, or zeroed, what it was meant for."""
        self._axis.take_over()
        self._phase = _Phase.IDLE
        self._started = bool(self._axis.points.controlword & _START)

    def take(self) -> None:
        """Start, or interrupt, on bit 4 of the controlword."""
        level = bool(self._axis.points.controlword & _START)
        if level and not self._started:
            self._begin()
        elif not level and self._phase is not _Phase.DONE:
            self._phase = _Phase.IDLE
        self._started = level

    def tick(self) -> None:
        """One step of the search."""
        axis, parameters = self._axis, self._axis.parameters
        if self._phase is _Phase.SEARCHING and self._revolution() != self._turn:
            # The pulse is where a revolution begins: the new one going up, the one just left going down.
            index = self._revolution() if parameters.homing_method == POSITIVE_INDEX else self._turn
            axis.go_home(index * axis.hardware.counts_per_revolution)
            self._phase = _Phase.STOPPING
        target = 0.0
        if self._phase is _Phase.SEARCHING:
            sign = 1.0 if parameters.homing_method == POSITIVE_INDEX else -1.0
            target = math.copysign(parameters.homing_speed, sign)
        last = axis.velocity_demand
        axis.velocity_demand = approach(last, target, parameters.homing_acceleration * TICK)
        axis.control_velocity((axis.velocity_demand - last) / TICK)
        resting = self._rest.update(
            abs(axis.velocity()) <= parameters.velocity_threshold, parameters.velocity_threshold_time
        )
        if self._phase is _Phase.STOPPING and resting:
            self._phase = _Phase.DONE

    def status(self) -> int:
        """Bits 10 and 12; 13 (homing error) cannot happen: a shaft without stops has an index in every turn."""
        return _BITS[self._phase]

    def _begin(self) -> None:
        method = self._axis.parameters.homing_method
        if method in PRESENT_POSITION:
            self._axis.go_home(self._axis.hardware.position())
            self._phase = _Phase.DONE
        elif method:
            self._turn = self._revolution()
            self._phase = _Phase.SEARCHING

    def _revolution(self) -> int:
        return self._axis.hardware.position() // self._axis.hardware.counts_per_revolution

"""Modes with a position loop: profile position and cyclic synchronous position."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import Final

from emulator.firmware.drive.axis import TICK, Axis, approach, shorter_way
from emulator.firmware.drive.modes import FOLLOWS_COMMAND, POSITION_ERROR, TARGET_REACHED, Steady
from emulator.firmware.drive.tracking import Limits, Tracking

_NEW_SETPOINT: Final = 1 << 4
_IMMEDIATELY: Final = 1 << 5
_RELATIVE: Final = 1 << 6
_ACKNOWLEDGE: Final = 1 << 12


class RelativeTo(IntEnum):
    """Values of 60F2h: what a relative target (bit 6) of profile position counts from."""

    PRECEDING_TARGET = 0
    """The target before it, or the demand where there was none."""
    DEMAND = 1
    """6062h."""
    POSITION = 2
    """6064h."""


class PositionLoop:
    """P controller of the position over the velocity loop, with the monitoring of the following error.

    Attributes:
        failed: the error has been beyond 6065h for longer than 6066h.
    """

    def __init__(self, axis: Axis) -> None:
        self._axis = axis
        self._late = Steady()
        self.failed = False

    def start(self) -> None:
        """From the present position and speed."""
        self._axis.take_over()
        self._axis.position_demand = float(self._axis.position())
        self._late.reset()
        self.failed = False

    def step(self, slope: float, *, acceleration: float = 0.0, offset: float = 0.0, extra: float = 0.0) -> None:
        """One tick.

        Args:
            slope: of the position demand [increments / s].
            acceleration: of the demand, fed forward [rad/s^2].
            offset: to add to the velocity [increments / s].
            extra: torque to add [Nm].
        """
        axis, parameters = self._axis, self._axis.parameters
        axis.position_demand += slope * TICK
        error = axis.following_error()
        demand = (slope + offset + parameters.position_gain * error) / axis.increments
        axis.velocity_demand = min(max(demand, -parameters.max_motor_speed), parameters.max_motor_speed)
        axis.control_velocity(acceleration, extra)
        self.failed = self._late.update(abs(error) > parameters.following_window, parameters.following_time)


class CyclicPosition:
    """Cyclic synchronous position: 607Ah + 60B0h, interpolated, velocity and torque offsets fed forward.

    A target that was written before this mode had power is not gone to: the drive comes to rest where it is, at 60C6h,
    and stays until the master writes another.
    """

    ticks = True

    def __init__(self, axis: Axis) -> None:
        self._axis = axis
        self._loop = PositionLoop(axis)
        self._tracking = Tracking()
        self._writes = 0
        self._goal: float | None = None
        self._beyond = False

    @property
    def failed(self) -> bool:
        """The following error has lasted too long."""
        return self._loop.failed

    def start(self) -> None:
        """From the present position and speed."""
        axis = self._axis
        self._loop.start()
        self._tracking.start(axis.velocity() * axis.increments)
        axis.points.position_writes = self._writes = 0
        self._goal = None

    def take(self) -> None:
        """A new set-point to go to."""
        points, period = self._axis.points, self._axis.parameters.interpolation_time
        self._tracking.begin(period)
        if points.position_writes != self._writes:
            self._writes = points.position_writes
            goal, last = self._asked(), self._goal
            self._tracking.set_point(None if last is None else shorter_way(goal - last), period)
            self._goal = goal

    def tick(self) -> None:
        """One step along the line, and of the position and velocity loops."""
        if self._goal is None:
            self._loop.step(self._tracking.rest(self._limits()))
            return
        axis, points = self._axis, self._axis.points
        distance = shorter_way(self._asked() - axis.position_demand)
        slope, as_asked = self._tracking.step(distance, self._limits())
        offset = axis.velocity_sign * points.velocity_offset
        self._loop.step(slope, offset=offset, extra=points.torque_offset * axis.permille)
        axis.limited = axis.limited or self._beyond or not as_asked

    def status(self) -> int:
        """Bits 12, and 13 where the following error has lasted too long (6065h, 6066h)."""
        return FOLLOWS_COMMAND | (POSITION_ERROR if self.failed else 0)

    def _asked(self) -> float:
        """607Ah + 60B0h within 607Dh, in the sense of the motor [increments]."""
        axis = self._axis
        asked = axis.points.target_position + axis.points.position_offset
        allowed = axis.within_limits(asked)
        self._beyond = allowed != asked
        return axis.position_sign * allowed

    def _limits(self) -> Limits:
        parameters, scale = self._axis.parameters, self._axis.increments
        return Limits(
            parameters.profile_speed * scale,
            parameters.max_acceleration * scale,
            parameters.max_deceleration * scale,
            parameters.interpolation_time,
        )


class ProfilePosition:
    """Profile position: 607Ah on the rising edge of bit 4, at 6081h, 6083h and 6084h; one set-point may wait.

    A target survives a halt (bit 8), after which the motion goes on; it is gone when operation was left.
    """

    ticks = True

    def __init__(self, axis: Axis) -> None:
        self._axis = axis
        self._loop = PositionLoop(axis)
        self._there = Steady()
        self._speed = 0.0
        self._asked = False
        self._waiting: float | None = None
        self._acknowledged = False
        self._reached = True
        self._beyond = False

    @property
    def failed(self) -> bool:
        """The following error has lasted too long."""
        return self._loop.failed

    def start(self) -> None:
        """From the present position and speed; bit 4 has to rise from now on."""
        self._loop.start()
        self._speed = self._axis.velocity()
        self._asked = bool(self._axis.points.controlword & _NEW_SETPOINT)
        self._waiting = None
        self._acknowledged = False
        self._reached = self._axis.goal is None
        self._beyond = self._beyond and not self._reached

    def take(self) -> None:
        """Follow bits 4 to 6 of the controlword."""
        controlword = self._axis.points.controlword
        asked = bool(controlword & _NEW_SETPOINT)
        if asked and not self._asked and self._waiting is None:
            self._accept(controlword)
        elif not asked:
            self._acknowledged = self._waiting is not None
        self._asked = asked

    def tick(self) -> None:
        """One step of the profile, and of the position and velocity loops."""
        axis, parameters = self._axis, self._axis.parameters
        distance = 0.0 if axis.goal is None else shorter_way(axis.goal - axis.position_demand) / axis.increments
        last = self._speed
        self._speed = self._profile(distance)
        arrives = abs(distance) <= abs(self._speed) * TICK and abs(self._speed) <= parameters.deceleration * TICK
        if arrives:
            slope, self._speed = distance / TICK * axis.increments, 0.0
        else:
            slope = self._speed * axis.increments
        self._loop.step(slope, acceleration=(self._speed - last) / TICK)
        axis.limited = axis.limited or self._beyond
        if axis.goal is not None:
            self._look(axis.goal, arrives or (distance == 0.0 and self._speed == 0.0))

    def status(self) -> int:
        """Bits 10 (6067h, 6068h), 12 (set-point acknowledge) and 13 (following error)."""
        return (
            (TARGET_REACHED if self._reached else 0)
            | (_ACKNOWLEDGE if self._acknowledged else 0)
            | (POSITION_ERROR if self.failed else 0)
        )

    def _accept(self, controlword: int) -> None:
        axis = self._axis
        asked = float(axis.target())
        if controlword & _RELATIVE:
            way = axis.points.target_position if axis.points.position_writes else 0
            asked = axis.position_sign * self._start_of_way() + way
        allowed = axis.within_limits(asked)
        self._beyond = allowed != asked
        target = axis.position_sign * allowed
        self._acknowledged = True
        if self._reached or controlword & _IMMEDIATELY:
            self._go(target)
        else:
            self._waiting = target

    def _start_of_way(self) -> float:
        """What a relative target counts from, in the sense of the motor [increments]."""
        axis, option = self._axis, self._axis.parameters.positioning_options
        before = self._waiting if self._waiting is not None else axis.goal
        if option == RelativeTo.POSITION:
            return float(axis.position())
        return axis.position_demand if option == RelativeTo.DEMAND or before is None else before

    def _go(self, target: float) -> None:
        self._axis.goal = target
        self._reached = False
        self._there.reset()

    def _profile(self, distance: float) -> float:
        """Speed of the next tick [rad/s]: as fast as allowed, and slow enough to stop at the target."""
        parameters = self._axis.parameters
        slow_down = min(parameters.deceleration, parameters.max_deceleration)
        half = slow_down * TICK / 2.0
        fastest = min(parameters.profile_velocity, parameters.profile_speed)
        allowed = min(fastest, math.sqrt(half**2 + 2.0 * slow_down * abs(distance)) - half)
        target = math.copysign(allowed, distance)
        slows = abs(target) < abs(self._speed) or target * self._speed < 0.0
        rate = slow_down if slows else min(parameters.acceleration, parameters.max_acceleration)
        return approach(self._speed, target, rate * TICK)

    def _look(self, goal: float, ended: bool) -> None:
        axis, parameters = self._axis, self._axis.parameters
        near = ended and abs(shorter_way(goal - axis.position())) <= parameters.position_window
        if self._there.update(near, parameters.position_window_time):
            self._reached = True
            if self._waiting is not None:
                waiting, self._waiting = self._waiting, None
                self._acknowledged = self._asked
                self._go(waiting)

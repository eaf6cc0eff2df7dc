"""Modes of operation of CiA 402-2: what each does with its set-points, and its bits of the statusword."""

from __future__ import annotations

from enum import IntEnum
from typing import Final, Protocol

from emulator.firmware.drive.axis import TICK, Axis, approach


class Mode(IntEnum):
    """Values of 6060h that this drive knows."""

    NONE = 0
    PROFILE_POSITION = 1
    PROFILE_VELOCITY = 3
    PROFILE_TORQUE = 4
    HOMING = 6
    CYCLIC_POSITION = 8
    CYCLIC_VELOCITY = 9
    CYCLIC_TORQUE = 10


TORQUE_MODES: Final = (Mode.NONE, Mode.PROFILE_TORQUE, Mode.CYCLIC_TORQUE)
"""Where the slow-down ramp is one of torque (6087h)."""

HALTING_MODES: Final = (Mode.PROFILE_POSITION, Mode.PROFILE_VELOCITY, Mode.PROFILE_TORQUE, Mode.HOMING)
"""Where bit 8 of the controlword means halt; the cyclic modes have no such bit."""

TARGET_REACHED: Final = 1 << 10
FOLLOWS_COMMAND: Final = 1 << 12
SPEED_IS_ZERO: Final = 1 << 12
HOMING_ATTAINED: Final = 1 << 12
POSITION_ERROR: Final = 1 << 13


class Motion(Protocol):
    """What the axis does while operation is enabled."""

    ticks: bool
    """Whether it needs the drive's own loops; a torque set-point of the bus needs none."""

    @property
    def failed(self) -> bool:
        """The following error has lasted too long."""

    def start(self) -> None:
        """From now on."""

    def take(self) -> None:
        """Set-points or controlword may have changed."""

    def tick(self) -> None:
        """One period of the drive's own loops."""

    def status(self) -> int:
        """Mode-specific bits of the statusword: 10, 12, 13."""


class Steady:
    """Says whether something has held for a time.

    Args:
        duration: [s].
    """

    def __init__(self) -> None:
        self._held = 0.0

    def reset(self) -> None:
        """Begin anew."""
        self._held = 0.0

    def update(self, holds: bool, duration: float) -> bool:
        """Count one tick; whether it has held for `duration` [s]."""
        self._held = self._held + TICK if holds else 0.0
        return holds and self._held >= duration


class NoMotion:
    """No mode selected: no torque."""

    ticks = failed = False

    def __init__(self, axis: Axis) -> None:
        self._axis = axis

    def start(self) -> None:
        """Zero torque."""
        self.take()

    def take(self) -> None:
        """Zero torque, whatever is written."""
        self._axis.torque_demand = 0
        self._axis.limited = False
        self._axis.hardware.command(0.0)

    def tick(self) -> None:
        """Nothing to control."""

    def status(self) -> int:
        """No bits."""
        return 0


class CyclicTorque:
    """Cyclic synchronous torque: 6071h + 60B2h, interpolated by the current loop."""

    ticks = failed = False

    def __init__(self, axis: Axis) -> None:
        self.start = self.take = axis.follow_torque

    def tick(self) -> None:
        """The current loop interpolates."""

    def status(self) -> int:
        """The drive follows its command value."""
        return FOLLOWS_COMMAND


class ProfileTorque:
    """Profile torque: 6071h, approached at the torque slope 6087h."""

    ticks, failed = True, False

    def __init__(self, axis: Axis) -> None:
        self._axis = axis
        self._demand = 0.0

    def start(self) -> None:
        """From the torque asked for last."""
        self._demand = float(self._axis.torque_demand)

    def take(self) -> None:
        """The ramp looks at the target by itself."""

    def tick(self) -> None:
        """One step along the slope, which does not climb beyond the limits: it would have to come back first."""
        axis, parameters = self._axis, self._axis.parameters
        target = axis.points.target_torque
        allowed = min(max(target, parameters.lowest_torque), parameters.highest_torque)
        self._demand = approach(self._demand, allowed, parameters.torque_slope * TICK)
        axis.control_torque(self._demand)
        axis.limited = axis.limited or target != allowed

    def status(self) -> int:
        """Bit 10: the torque that is asked of the motor has come to the target; a limit may keep it away."""
        axis = self._axis
        reached = self._demand == axis.points.target_torque and not axis.limited
        return TARGET_REACHED if reached else 0


class ProfileVelocity:
    """Profile velocity: 60FFh, approached at 6083h and 6084h."""

    ticks, failed = True, False

    def __init__(self, axis: Axis) -> None:
        self._axis = axis
        self._at_target, self._at_rest = Steady(), Steady()
        self._bits = 0

    def start(self) -> None:
        """From the present speed."""
        self._axis.take_over()
        self._at_target.reset()
        self._at_rest.reset()
        self._bits = 0

    def take(self) -> None:
        """The ramp looks at the target by itself."""

    def tick(self) -> None:
        """One step along the ramp, and of the velocity loop."""
        axis, parameters = self._axis, self._axis.parameters
        asked = axis.velocity_sign * axis.points.target_velocity / axis.increments
        target = min(max(asked, -parameters.profile_speed), parameters.profile_speed)
        last = axis.velocity_demand
        slows = abs(target) < abs(last) or target * last < 0.0
        rate = (
            min(parameters.deceleration, parameters.max_deceleration)
            if slows
            else min(parameters.acceleration, parameters.max_acceleration)
        )
        axis.velocity_demand = approach(last, target, rate * TICK)
        axis.control_velocity((axis.velocity_demand - last) / TICK)
        axis.limited = axis.limited or target != asked
        velocity = axis.velocity()
        reached = self._at_target.update(
            abs(velocity - target) <= parameters.velocity_window, parameters.velocity_window_time
        )
        resting = self._at_rest.update(
            abs(velocity) <= parameters.velocity_threshold, parameters.velocity_threshold_time
        )
        self._bits = (TARGET_REACHED if reached else 0) | (SPEED_IS_ZERO if resting else 0)

    def status(self) -> int:
        """Bits 10 (606Dh, 606Eh) and 12 (606Fh, 6070h)."""
        return self._bits


class Interpolation:
    """A straight line to each new set-point, over the interpolation time 60C2h."""

    def __init__(self) -> None:
        self.left = 0

    def begin(self, duration: float) -> None:
        """A set-point has come, to be reached in `duration` [s]."""
        self.left = max(1, round(duration / TICK))

    def step(self, distance: float) -> float:
        """What to move in this tick when `distance` is left; all of it once the time is over."""
        part = distance / max(self.left, 1)
        self.left = max(self.left - 1, 0)
        return part


class CyclicVelocity:
    """Cyclic synchronous velocity: 60FFh + 60B1h, interpolated, with 60B2h as extra torque."""

    ticks, failed = True, False

    def __init__(self, axis: Axis) -> None:
        self._axis = axis
        self._line = Interpolation()

    def start(self) -> None:
        """From the present speed."""
        self._axis.take_over()
        self.take()

    def take(self) -> None:
        """A new set-point to go to."""
        self._line.begin(self._axis.parameters.interpolation_time)

    def tick(self) -> None:
        """One step along the line, and of the velocity loop."""
        axis = self._axis
        points, speed = axis.points, axis.parameters.max_motor_speed
        asked = axis.asked_velocity()
        target = min(max(asked, -speed), speed)
        axis.velocity_demand += self._line.step(target - axis.velocity_demand)
        axis.control_velocity(0.0, points.torque_offset * axis.permille)
        axis.limited = axis.limited or target != asked

    def status(self) -> int:
        """The drive follows its command value."""
        return FOLLOWS_COMMAND

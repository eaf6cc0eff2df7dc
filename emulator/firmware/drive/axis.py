"""One axis: set-points and measurements, velocity and torque control towards the power stage."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Final

from emulator.firmware.drive.parameters import Parameters
from emulator.firmware.hardware import DriveHardware
from emulator.firmware.timers import Timers

TICK: Final = 0.001
"""Period of the drive's own loops [s]; the current loop below is the hardware's."""

_SPAN: Final = 1 << 32
_HALF: Final = 1 << 31


def wrap(count: int) -> int:
    """`count` in a signed 32-bit register."""
    return (count + _HALF) % _SPAN - _HALF


def shorter_way(distance: float) -> float:
    """`distance` [increments] by the shorter way round the 32-bit register."""
    return (distance + _HALF) % _SPAN - _HALF


def approach(value: float, target: float, step: float) -> float:
    """`value` moved towards `target` by at most `step`."""
    return min(value + step, target) if target > value else max(value - step, target)


@dataclass
class Setpoints:
    """What the master has written, in the units of the objects.

    Attributes:
        controlword: the last one that was processed.
        written_controlword: the last one that was written; one of a drive under local control is not processed.
        position_writes: times that 607Ah was written since there was nothing to go by.
    """

    controlword: int = 0
    written_controlword: int = 0
    target_torque: int = 0
    target_velocity: int = 0
    target_position: int = 0
    torque_offset: int = 0
    velocity_offset: int = 0
    position_offset: int = 0
    position_writes: int = 0

    def aim(self, position: int) -> None:
        """The master has written 607Ah."""
        self.target_position = position
        self.position_writes += 1

    def forget(self) -> None:
        """What was asked for counts for nothing any more; the controlword is the master's."""
        controlwords = self.controlword, self.written_controlword
        self.clear()
        self.controlword, self.written_controlword = controlwords

    def clear(self) -> None:
        """Nothing is asked for."""
        for field in fields(self):
            setattr(self, field.name, 0)


class Axis:
    """Control of one motor shaft; the motor's sign, rad and Nm inside, increments and per mille for the objects.

    The velocity loop is a PI controller with the inertia of the load fed forward. Its integral part stands
    still while the torque is limited.

    Args:
        hardware: power stage, motor and encoder.
        parameters: gains and limits.
        timers: simulated time.

    Attributes:
        points: set-points of the master.
        torque_demand: [per mille of rated torque].
        velocity_demand: [rad/s].
        position_demand: [increments], counted without end.
        goal: where profile position is on its way to [increments], None where it is not.
        home, home_position: the count of the encoder that is position 0, and the home position as 6064h shows it.
        position_sign, velocity_sign: 607Eh; the objects are by these factors what the motor does. Everything here but
            `points` is the motor's own.
        limited: torque, speed or position is not what was asked for.
        count, read_at: last reading of the encoder [increments], and its instant [s].
    """

    def __init__(self, hardware: DriveHardware, parameters: Parameters, timers: Timers) -> None:
        self._timers = timers
        self.count, self.read_at = 0, -1.0
        self.hardware = hardware
        self.parameters = parameters
        self.points = Setpoints()
        self.permille = hardware.rated_torque / 1000.0
        self.increments = hardware.counts_per_revolution / math.tau
        self.torque_demand = 0
        self.velocity_demand = 0.0
        self.position_demand = 0.0
        self.goal: float | None = None
        self.limited = False
        self.home = 0
        self.home_position = 0
        self.position_sign = self.velocity_sign = 1
        self._integral = 0.0

    def reset(self) -> None:
        """Power-on: nothing asked for, the encoder's own zero."""
        self.points.clear()
        self.home = self.home_position = 0
        self.turn_round()
        self.release()

    def turn_round(self) -> None:
        """Take over 607Eh."""
        self.position_sign, self.velocity_sign = self.parameters.position_sign, self.parameters.velocity_sign

    def go_home(self, count: int) -> None:
        """The home position is at this count of the encoder: 6064h is 607Ch there."""
        self.home_position = int(self.parameters.home_offset)
        self.home = wrap(count - self.position_sign * self.home_position)

    def release(self) -> None:
        """No demand: the power is off."""
        self.torque_demand = 0
        self.velocity_demand = 0.0
        self.position_demand = float(self.position())
        self.goal = None
        self.limited = False
        self._integral = 0.0

    def position(self) -> int:
        """Of the shaft [increments]."""
        self.count, self.read_at = self.hardware.position(), self._timers.now
        return (self.count - self.home + _HALF) % _SPAN - _HALF

    def shown_position(self) -> int:
        """6064h [increments]."""
        self.count, self.read_at = self.hardware.position(), self._timers.now
        return (self.position_sign * (self.count - self.home) + _HALF) % _SPAN - _HALF

    def target(self) -> int:
        """607Ah [increments]; it follows the position until the master has written one."""
        return self.points.target_position if self.points.position_writes else self.shown_position()

    def within_limits(self, position: float) -> float:
        """A position of the objects within 607Dh, which counts from the home position [increments]."""
        low, high = self.parameters.lowest_position, self.parameters.highest_position
        if low >= high:
            return position
        return min(max(position, low + self.home_position), high + self.home_position)

    def asked_velocity(self) -> float:
        """60FFh + 60B1h, in the sense of the motor [rad/s]."""
        points = self.points
        return self.velocity_sign * (points.target_velocity + points.velocity_offset) / self.increments

    def velocity(self) -> float:
        """Of the shaft [rad/s]."""
        return self.hardware.velocity()

    def following_error(self) -> float:
        """Position demand less position [increments]."""
        return shorter_way(self.position_demand - self.position())

    def take_over(self) -> None:
        """Start velocity control without a jump: from the present speed and the torque asked for last."""
        self.velocity_demand = self.velocity()
        self._integral = self.torque_demand * self.permille

    def control_torque(self, permille: float) -> None:
        """Ask for a torque from the drive's own ramp, within all limits."""
        self._command(permille * self.permille)

    def control_velocity(self, acceleration: float, extra: float = 0.0, share: float = 1.0) -> None:
        """One step of the velocity loop towards `velocity_demand`.

        Args:
            acceleration: of the demand, fed forward through the inertia of the load [rad/s^2].
            extra: torque to add [Nm].
            share: of the torque limit that may be used [-].
        """
        parameters = self.parameters
        error = self.velocity_demand - self.velocity()
        direct = parameters.velocity_gain * error + parameters.load_inertia * acceleration + extra
        step = parameters.velocity_gain * error * TICK / parameters.velocity_integration_time
        if not self._command(direct + self._integral + step, share) or step * (direct + self._integral) < 0.0:
            self._integral += step

    def _command(self, torque: float, share: float = 1.0) -> bool:
        """Ask the current loop for a torque [Nm]; whether it was limited."""
        high = self.parameters.highest_torque * self.permille * share
        low = self.parameters.lowest_torque * self.permille * share
        allowed = min(max(self._governed(torque), low), high)
        self.hardware.control(allowed)
        self.torque_demand = round(allowed / self.permille)
        self.limited = allowed != torque
        return self.limited

    def _governed(self, torque: float) -> float:
        """The torque less what would drive the motor beyond 6080h, by the gain of the velocity loop."""
        velocity = self.velocity()
        excess = abs(velocity) - self.parameters.max_motor_speed
        if excess <= 0.0 or torque * velocity <= 0.0:
            return torque
        return math.copysign(max(0.0, abs(torque) - self.parameters.velocity_gain * excess), torque)

    def follow_torque(self) -> None:
        """Cyclic synchronous torque: hand the set-point of the bus to the current loop."""
        points, parameters = self.points, self.parameters
        target = points.target_torque + points.torque_offset
        demand = min(max(target, parameters.lowest_torque), parameters.highest_torque)
        if abs(self.hardware.velocity()) > parameters.max_motor_speed:
            demand = round(self._governed(demand * self.permille) / self.permille)
        self.torque_demand = demand
        self.limited = demand != target
        self.hardware.command(demand * self.permille)

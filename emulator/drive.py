"""Wheel drive below the firmware: power stage, current loop, motor, motor encoder."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

from emulator.encoder import wrap_signed
from emulator.noise import Disturbances
from emulator.power_stage import PowerStage, PowerStageData, Trip
from emulator.prototype import DriveData


class Shafts(Protocol):
    """The motor shafts as their encoders take them, divided by the gear ratio; wheels fl, rl, fr, rr."""

    @property
    def step_size(self) -> float:
        """Of the engine [s]."""

    def wheel_angle(self, wheel: int) -> float:
        """[rad]."""

    def wheel_rate(self, wheel: int) -> float:
        """[rad/s]."""


class Drive:
    """Power stage, motor and motor encoder of one wheel, in the drive's own sign (mounting applied inside).

    A set-point is reached linearly over the interpolation time, then passes the first-order current loop.
    Both are evaluated exactly at the engine's steps. Between two equally spaced set-points torque is thus a
    straight line, and its sample at a bus cycle is the mean over the cycle around it: reading torque and
    position at one SYNC is free of the half-cycle lag that a staircase of set-points would put between them.

    Attributes:
        rated_torque, peak_torque: at the motor shaft [Nm].
        rated_current, peak_current: rms [A].
        counts_per_revolution: motor increments per turn of the shaft.
        torque: actual torque at the motor shaft at the present time [Nm], drive's sign.
        wheel_torque: the same torque at the wheel [Nm], positive rolls the vehicle forward.
    """

    def __init__(
        self,
        data: DriveData,
        stage: PowerStageData,
        wheel: int,
        gear_ratio: float,
        shafts: Shafts,
        disturbances: Disturbances,
    ) -> None:
        self.rated_torque = data.rated_torque
        self.peak_torque = data.peak_torque
        self.rated_current = data.rated_current
        self.peak_current = data.peak_current
        self.counts_per_revolution = data.counts_per_revolution
        self.torque = 0.0
        self.wheel_torque = 0.0
        self._shaft_ratio = data.directions[wheel] * gear_ratio
        self._increments = self._shaft_ratio * data.counts_per_revolution / math.tau
        self._wheel = wheel
        self._shafts = shafts
        self._disturbances = disturbances
        self._stage = PowerStage(stage, data.rated_torque, data.peak_torque, data.rated_current, shafts.step_size)
        self._enabled = False
        self._target = self._setpoint = 0.0
        self._ramp_steps = max(1, round(data.interpolation_time / shafts.step_size))
        self._steps_left = 0
        # Exact response of T' = w (s - T) over one step while s goes linearly from s0 to s1.
        lag = data.current_loop_bandwidth * shafts.step_size
        self._keep = math.exp(-lag)
        self._from_end = 1 - (1 - self._keep) / lag
        self._from_start = 1 - self._keep - self._from_end

    @property
    def enabled(self) -> bool:
        """Whether the power stage is on."""
        return self._enabled

    @property
    def voltage(self) -> float:
        """Of the DC link [V]."""
        return self._stage.voltage

    @property
    def voltage_range(self) -> tuple[float, float]:
        """DC-link voltages at which the chopper starts and at which the drive trips [V]."""
        return self._stage.voltage_range

    @property
    def thermal_load(self) -> float:
        """I2t load [-]; rated current settles at 1."""
        return self._stage.thermal_load

    def watch(self, tripped: Callable[[Trip], None]) -> None:
        """Call `tripped` whenever the power stage trips."""
        self._stage.watch(tripped)

    def trip(self, cause: Trip) -> None:
        """Let the protection respond to something that it has noticed; without power it may do so again and again."""
        if not self._enabled:
            self._stage.clear()
        self._stage.report(cause)

    def enable(self) -> None:
        """Switch the power stage on, at zero torque; an earlier trip is forgotten."""
        self._stage.clear()
        self._enabled = True

    def disable(self) -> None:
        """Switch the power stage off: the torque vanishes at once and the set-point is forgotten."""
        self._enabled = False
        self._target = self._setpoint = self.torque = self.wheel_torque = 0.0
        self._steps_left = 0

    def command(self, torque: float) -> None:
        """Set-point at the motor shaft [Nm], drive's sign, limited to peak torque; void while disabled.

        It is reached over the interpolation time, as set-points of the bus are in cyclic modes.
        """
        if self._enabled:
            self._target = min(max(torque, -self.peak_torque), self.peak_torque)
            self._steps_left = self._ramp_steps

    def control(self, torque: float) -> None:
        """Set-point of the drive's own loops, as `command`; they run as fast as the engine: no interpolation."""
        if self._enabled:
            self._target = min(max(torque, -self.peak_torque), self.peak_torque)
            self._steps_left = 1

    def measured_torque(self) -> float:
        """Instantaneous torque at the motor shaft plus sensor noise [Nm], drive's sign."""
        return self.torque + self._disturbances.torque_reading[self._wheel]

    def position(self) -> int:
        """Motor position [increments], signed 32 bit wrapped, drive's sign."""
        exact = self._increments * self._shafts.wheel_angle(self._wheel)
        return wrap_signed(round(exact + self._disturbances.motor_dither[self._wheel]))

    def velocity(self) -> float:
        """Speed of the motor shaft [rad/s], drive's sign."""
        return self._shaft_ratio * self._shafts.wheel_rate(self._wheel)

    def advance(self) -> None:
        """Move set-point and current by one engine step."""
        if not self._enabled:
            self._stage.rest()
            return
        start = self._setpoint
        if self._steps_left:
            self._setpoint = start + (self._target - start) / self._steps_left
            self._steps_left -= 1
        self.torque = self._keep * self.torque + self._from_start * start + self._from_end * self._setpoint
        self.wheel_torque = self._shaft_ratio * self.torque
        trip = self._stage.advance(self.torque, self.velocity())
        if trip is not None:
            self._stage.report(trip)

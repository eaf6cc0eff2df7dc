"""What the firmware needs of the hardware that it runs on; shaft side, in the sign of the device itself."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from emulator.power_stage import Trip


class DriveHardware(Protocol):
    """Power stage, motor and shaft encoder of one drive."""

    @property
    def rated_torque(self) -> float:
        """Torque that one thousand per mille stand for [Nm]."""

    @property
    def rated_current(self) -> float:
        """Current at rated torque [A]."""

    @property
    def counts_per_revolution(self) -> int:
        """Increments of the shaft encoder per motor revolution."""

    @property
    def voltage(self) -> float:
        """Of the DC link [V]."""

    @property
    def voltage_range(self) -> tuple[float, float]:
        """DC-link voltages at which the brake chopper starts and at which the protection responds [V]."""

    @property
    def thermal_load(self) -> float:
        """I2t load [-]; rated current settles at 1."""

    def watch(self, tripped: Callable[[Trip], None]) -> None:
        """Call `tripped` whenever the protection responds."""

    def enable(self) -> None:
        """Switch the power stage on; the torque command starts at zero."""

    def disable(self) -> None:
        """Switch the power stage off; the shaft coasts."""

    def command(self, torque: float) -> None:
        """Ask the current loop for a shaft torque [Nm], reached over the interpolation time of the bus cycle."""

    def control(self, torque: float) -> None:
        """Ask the current loop for a shaft torque [Nm] at once, as the drive's own loops do."""

    def measured_torque(self) -> float:
        """Shaft torque from the measured current [Nm]."""

    def position(self) -> int:
        """Shaft position [counts]; only differences modulo 2^32 matter."""

    def velocity(self) -> float:
        """Shaft velocity [rad/s]."""


class EncoderHardware(Protocol):
    """One absolute encoder."""

    @property
    def counts_per_revolution(self) -> int:
        """Physical increments of one turn."""

    def position(self) -> int:
        """Physical position [counts], unsigned."""


class VehicleHardware(Protocol):
    """Everything that the devices of one network sit on."""

    @property
    def drives(self) -> Sequence[DriveHardware]:
        """The four drives: fl, rl, fr, rr."""

    @property
    def encoders(self) -> Sequence[EncoderHardware]:
        """The two steering encoders: left, right."""

    @property
    def time(self) -> float:
        """Simulated time [s]."""

    def advance(self, duration: float) -> None:
        """Let `duration` seconds pass."""

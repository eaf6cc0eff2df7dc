"""The vehicle's hardware with its encoders in reach: they can stick at a count, or be off by some."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol, cast

from emulator.firmware.hardware import DriveHardware, EncoderHardware, VehicleHardware


class _Positioned(Protocol):
    @property
    def counts_per_revolution(self) -> int: ...

    def position(self) -> int: ...


class EncoderTap:
    """A drive or an encoder whose position and speed can be had from here; everything else is the hardware's own.

    As long as nothing is wrong the methods are the hardware's themselves, and cost what they cost there.

    Attributes:
        position: position [counts], as faulty as it is.
        velocity: speed of the axis [rad/s], from the same encoder: zero while it sticks; of a drive only.
    """

    position: Callable[[], int]
    velocity: Callable[[], float]

    def __init__(self, hardware: _Positioned) -> None:
        self._hardware = hardware
        self._stuck: int | None = None
        self._offset = 0
        self.counts_per_revolution = hardware.counts_per_revolution
        self._connect()

    @property
    def thermal_load(self) -> float:
        """I2t load of a drive [-]; here because it is asked for in every cycle."""
        return cast(DriveHardware, self._hardware).thermal_load

    def stick(self) -> None:
        """Stay at the present count."""
        self._stuck = self.position()
        self._connect()

    def release(self) -> None:
        """Follow the axis again."""
        self._stuck = None
        self._connect()

    def jump(self, counts: int) -> None:
        """Be off by so many more counts."""
        self._offset += counts
        self._connect()

    def _connect(self) -> None:
        """Decide where position and speed come from."""
        hardware, stuck, offset = self._hardware, self._stuck, self._offset
        if stuck is not None:
            self.position, self.velocity = (lambda: stuck), (lambda: 0.0)
            return
        self.position = (lambda: hardware.position() + offset) if offset else hardware.position
        if hasattr(hardware, "velocity"):
            self.velocity = hardware.velocity

    def __getattr__(self, name: str) -> Any:
        value = getattr(self._hardware, name)
        if callable(value):
            # Found once, a method costs no more than on the hardware itself.
            self.__dict__[name] = value
        return value


class TappedVehicle:
    """A vehicle's hardware, every drive and encoder behind an `EncoderTap`.

    Args:
        vehicle: the hardware.

    Attributes:
        taps: `drives` (fl, rl, fr, rr) and `encoders` (left, right).
    """

    def __init__(self, vehicle: VehicleHardware) -> None:
        self._vehicle = vehicle
        self.taps = {
            "drives": tuple(EncoderTap(drive) for drive in vehicle.drives),
            "encoders": tuple(EncoderTap(encoder) for encoder in vehicle.encoders),
        }
        self.drives = cast(Sequence[DriveHardware], self.taps["drives"])
        self.encoders = cast(Sequence[EncoderHardware], self.taps["encoders"])

    def advance(self, duration: float) -> None:
        """Let `duration` seconds pass."""
        self._vehicle.advance(duration)

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._vehicle.time

"""The vehicle's hardware with its encoders in reach: they can stick at a count, or be off by some."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol, cast

from emulator.firmware.hardware import DriveHardware, EncoderHardware, VehicleHardware


class _Positioned(Protocol):
    def position(self) -> int: ...


class EncoderTap:
    """A drive or an encoder whose position passes through here; everything else is the hardware's own."""

    def __init__(self, hardware: _Positioned) -> None:
        self._hardware = hardware
        self._stuck: int | None = None
        self._offset = 0

    def position(self) -> int:
        """Position [counts], as faulty as it is."""
        return self._hardware.position() + self._offset if self._stuck is None else self._stuck

    def stick(self) -> None:
        """Stay at the present count."""
        self._stuck = self.position()

    def release(self) -> None:
        """Follow the axis again."""
        self._stuck = None

    def jump(self, counts: int) -> None:
        """Be off by so many more counts."""
        self._offset += counts

    def velocity(self) -> float:
        """Speed of the axis [rad/s], from the same encoder: zero while it sticks."""
        return 0.0 if self._stuck is not None else cast(DriveHardware, self._hardware).velocity()

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

"""The objects of the drive profile: what reading and writing them does."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from emulator.firmware.dictionary import AbortCode, AbortError, Dictionary
from emulator.firmware.drive.axis import Setpoints, wrap
from emulator.firmware.drive.homing import METHODS
from emulator.firmware.drive.modes import Mode
from emulator.firmware.drive.parameters import POLARITY_BITS
from emulator.firmware.drive.positioning import RelativeTo

if TYPE_CHECKING:
    from emulator.firmware.drive.application import DriveApplication

_I16 = 32767
_I32 = 2**31 - 1

_SETPOINTS = {
    0x6071: "target_torque",
    0x60B0: "position_offset",
    0x60B1: "velocity_offset",
    0x60B2: "torque_offset",
    0x60FF: "target_velocity",
}
"""Objects that an RPDO puts in place before the drive acts on them all -> attribute of the set-points."""


def bind(drive: DriveApplication, objects: Dictionary) -> None:
    """Connect the object dictionary of a node with the drive on it."""
    _bind_measurements(drive, objects)
    _bind_demands(drive, objects)
    _bind_setpoints(drive, objects)
    objects.on_write(0x6098, 0, _check_method)
    objects.on_write(0x607E, 0, lambda value: _check_polarity(drive, value))
    objects.on_change(0x607E, 0, lambda _value: drive.axis.turn_round())
    objects.on_write(0x60F2, 0, _check_positioning_options)


def _bind_measurements(drive: DriveApplication, objects: Dictionary) -> None:
    axis, hardware = drive.axis, drive.axis.hardware
    increments = axis.increments
    rated_torque, rated_current = round(hardware.rated_torque * 1e3), round(hardware.rated_current * 1e3)

    def torque() -> int:
        return _clamp(round(hardware.measured_torque() / axis.permille), _I16)

    reads: dict[tuple[int, int], Callable[[], int]] = {
        (0x603F, 0): lambda: drive.error_code,
        (0x6041, 0): lambda: drive.statusword,
        (0x6061, 0): lambda: drive.mode,
        (0x6064, 0): axis.shown_position,
        (0x606C, 0): lambda: _clamp(round(axis.velocity_sign * hardware.velocity() * increments), _I32),
        (0x6075, 0): lambda: rated_current,
        (0x6076, 0): lambda: rated_torque,
        (0x6077, 0): torque,
        # Torque is proportional to current, so both have the same per-mille value.
        (0x6078, 0): torque,
        (0x6079, 0): lambda: round(hardware.voltage * 1e3),
        (0x608F, 1): lambda: hardware.counts_per_revolution,
    }
    _on_read(objects, reads)


def _bind_demands(drive: DriveApplication, objects: Dictionary) -> None:
    axis = drive.axis
    reads: dict[tuple[int, int], Callable[[], int]] = {
        (0x6062, 0): lambda: wrap(round(axis.position_sign * axis.position_demand)),
        (0x606B, 0): lambda: _clamp(round(axis.velocity_sign * axis.velocity_demand * axis.increments), _I32),
        (0x6074, 0): lambda: axis.torque_demand,
        (0x60F4, 0): lambda: _clamp(round(axis.position_sign * axis.following_error()), _I32),
    }
    _on_read(objects, reads)


def _bind_setpoints(drive: DriveApplication, objects: Dictionary) -> None:
    points: Setpoints = drive.axis.points

    def control(value: int) -> None:
        points.written_controlword = value
        # "If the bit remote is reset, then the drive ... will not execute the command message" (6041h, bit 9).
        if drive.remote:
            points.controlword = value
            drive.rpdo_applied()

    def latch_control(value: int) -> None:
        points.controlword = points.written_controlword = value

    objects.on_read(0x6040, 0, lambda: points.written_controlword)
    objects.on_write(0x6040, 0, control)
    objects.on_pdo_write(0x6040, 0, latch_control)
    objects.on_read(0x6060, 0, lambda: drive.mode)
    objects.on_write(0x6060, 0, lambda value: drive.select(_mode(value)))
    for index, name in _SETPOINTS.items():
        _bind_setpoint(drive, objects, index, name)
    objects.on_read(0x607A, 0, drive.axis.target)
    objects.on_write(0x607A, 0, lambda value: _follow(drive, value))
    objects.on_pdo_write(0x607A, 0, points.aim)


def _bind_setpoint(drive: DriveApplication, objects: Dictionary, index: int, name: str) -> None:
    points = drive.axis.points

    def write(value: int) -> None:
        setattr(points, name, value)
        drive.follow()

    objects.on_read(index, 0, lambda: int(getattr(points, name)))
    objects.on_write(index, 0, write)
    objects.on_pdo_write(index, 0, lambda value: setattr(points, name, value))


def _follow(drive: DriveApplication, position: int) -> None:
    drive.axis.points.aim(position)
    drive.follow()


def _on_read(objects: Dictionary, reads: dict[tuple[int, int], Callable[[], int]]) -> None:
    for (index, subindex), read in reads.items():
        objects.on_read(index, subindex, read)


def _mode(value: int) -> Mode:
    if value not in tuple(Mode):
        raise AbortError(AbortCode.VALUE_RANGE_EXCEEDED)
    return Mode(value)


def _check_method(value: int) -> None:
    if value not in METHODS:
        raise AbortError(AbortCode.VALUE_RANGE_EXCEEDED)


def _check_polarity(drive: DriveApplication, value: int) -> None:
    if value & ~POLARITY_BITS:
        raise AbortError(AbortCode.VALUE_RANGE_EXCEEDED)
    if drive.moving:
        raise AbortError(AbortCode.DEVICE_STATE)


def _check_positioning_options(value: int) -> None:
    if value not in tuple(RelativeTo):
        raise AbortError(AbortCode.VALUE_RANGE_EXCEEDED)


def _clamp(value: int, limit: int) -> int:
    return limit if value > limit else -limit if value < -limit else value

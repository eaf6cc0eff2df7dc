"""What can go wrong in a drive: error code, error register, and whether the power goes off at once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from emulator.firmware.emergency import ErrorCode, ErrorRegister
from emulator.power_stage import Trip


@dataclass(frozen=True)
class Fault:
    """One fault of the drive.

    Attributes:
        code: error code of 603Fh and of the EMCY message (CiA 402-2, table 7; CiA 301, table 26).
        register: bits of 1001h.
        fatal: braking is no longer possible or safe, so the power goes off whatever 605Eh says.
    """

    code: int
    register: ErrorRegister
    fatal: bool = False


_COMMUNICATION: Final = 0x8100
"""Communication, no detail (CiA 301, table 26): there is no code of its own for leaving operational."""

_R = ErrorRegister
CONNECTION_LOST: Final = Fault(ErrorCode.HEARTBEAT, _R.COMMUNICATION)
NOT_OPERATIONAL: Final = Fault(_COMMUNICATION, _R.COMMUNICATION)
SETPOINTS_MISSING: Final = Fault(ErrorCode.RPDO_TIMEOUT, _R.COMMUNICATION)
FOLLOWING_ERROR: Final = Fault(ErrorCode.FOLLOWING_ERROR, _R.DEVICE_PROFILE)
STOPPED_OUTSIDE: Final = Fault(ErrorCode.EXTERNAL, _R.GENERIC, fatal=True)
"""The emergency stop has opened the supply of the power stage."""

OF_TRIP: Final[Mapping[Trip, Fault]] = {
    Trip.OVER_CURRENT: Fault(ErrorCode.OVER_CURRENT, _R.CURRENT, fatal=True),
    Trip.OVER_VOLTAGE: Fault(ErrorCode.OVER_VOLTAGE, _R.VOLTAGE, fatal=True),
    Trip.OVER_TEMPERATURE: Fault(ErrorCode.OVER_TEMPERATURE, _R.TEMPERATURE),
    Trip.BLOCKED: Fault(ErrorCode.MOTOR_BLOCKED, _R.DEVICE_PROFILE, fatal=True),
    Trip.ENCODER: Fault(ErrorCode.ENCODER, _R.DEVICE_PROFILE, fatal=True),
}
"""What the protection responds to -> fault."""

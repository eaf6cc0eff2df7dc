"""The statusword 6041h (CiA 402-2, table 28): what holds in every mode, and the bits of the mode."""

from __future__ import annotations

from typing import Final

from emulator.firmware.drive.states import State

_VOLTAGE_ENABLED: Final = 1 << 4
_WARNING: Final = 1 << 7
_REMOTE: Final = 1 << 9
_INTERNAL_LIMIT: Final = 1 << 11

_POWERED: Final = (
    State.SWITCHED_ON,
    State.OPERATION_ENABLED,
    State.QUICK_STOP_ACTIVE,
    State.FAULT_REACTION_ACTIVE,
)


def compose(state: State, *, remote: bool, warns: bool, limited: bool, of_mode: int) -> int:
    """The statusword.

    Args:
        state: of the power drive system.
        remote: the controlword is processed (bit 9).
        warns: the I2t load is high (bit 7).
        limited: torque, speed or position is not what was asked for (bit 11).
        of_mode: bits 10, 12 and 13.
    """
    return (
        state.value
        | (_VOLTAGE_ENABLED if state in _POWERED else 0)
        | (_WARNING if warns else 0)
        | (_REMOTE if remote else 0)
        | (_INTERNAL_LIMIT if limited else 0)
        | of_mode
    )

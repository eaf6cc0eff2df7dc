"""The master's view of the CiA 402 state machine: statuswords to states, and which controlword leads on."""

from __future__ import annotations

from enum import Enum


class DriveState(Enum):
    """States of the power drive system; the value is (mask, pattern) of the statusword (CiA 402-2, table 30)."""

    NOT_READY_TO_SWITCH_ON = (0x4F, 0x00)
    SWITCH_ON_DISABLED = (0x4F, 0x40)
    READY_TO_SWITCH_ON = (0x6F, 0x21)
    SWITCHED_ON = (0x6F, 0x23)
    OPERATION_ENABLED = (0x6F, 0x27)
    QUICK_STOP_ACTIVE = (0x6F, 0x07)
    FAULT_REACTION_ACTIVE = (0x4F, 0x0F)
    FAULT = (0x4F, 0x08)

    @property
    def label(self) -> str:
        """The name of the standard."""
        return self.name.lower().replace("_", " ")


def decode_state(statusword: int) -> DriveState | None:
    """State that a statusword shows; None for a pattern that the standard does not know."""
    return next((state for state in DriveState if statusword & state.value[0] == state.value[1]), None)


SHUTDOWN = 0x06
SWITCH_ON = 0x07
ENABLE_OPERATION = 0x0F
DISABLE_VOLTAGE = 0x00
QUICK_STOP = 0x02
FAULT_RESET = 0x80

ENABLED_MASK, ENABLED_PATTERN = DriveState.OPERATION_ENABLED.value

_S = DriveState
POWERED = frozenset((_S.SWITCHED_ON, _S.OPERATION_ENABLED, _S.QUICK_STOP_ACTIVE, _S.FAULT_REACTION_ACTIVE))
"""States with the power stage on, or about to be."""

TO_OPERATION_ENABLED = {
    _S.NOT_READY_TO_SWITCH_ON: DISABLE_VOLTAGE,
    _S.SWITCH_ON_DISABLED: SHUTDOWN,
    _S.READY_TO_SWITCH_ON: SWITCH_ON,
    _S.SWITCHED_ON: ENABLE_OPERATION,
    _S.OPERATION_ENABLED: ENABLE_OPERATION,
    _S.QUICK_STOP_ACTIVE: DISABLE_VOLTAGE,
    _S.FAULT_REACTION_ACTIVE: DISABLE_VOLTAGE,
    _S.FAULT: FAULT_RESET,
}
"""State -> controlword that brings the drive nearer to operation enabled (transitions 2, 3, 4; 12; 15)."""

TO_SWITCH_ON_DISABLED = {
    _S.NOT_READY_TO_SWITCH_ON: DISABLE_VOLTAGE,
    _S.SWITCH_ON_DISABLED: DISABLE_VOLTAGE,
    _S.READY_TO_SWITCH_ON: DISABLE_VOLTAGE,
    _S.SWITCHED_ON: SHUTDOWN,
    _S.OPERATION_ENABLED: SHUTDOWN,
    _S.QUICK_STOP_ACTIVE: DISABLE_VOLTAGE,
    _S.FAULT_REACTION_ACTIVE: DISABLE_VOLTAGE,
    _S.FAULT: DISABLE_VOLTAGE,
}
"""State -> controlword that brings the drive nearer to switch-on disabled (transitions 8, 6, 7; 12)."""

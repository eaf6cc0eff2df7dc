"""The master's view of the CiA 402 state machine: statuswords to states, and which controlword leads on."""

from __future__ import annotations

from hil.network.cia import Controlword, DriveState


def decode_state(statusword: int) -> DriveState | None:
    """State that a statusword shows; None for a pattern that the standard does not know."""
    return next((state for state in DriveState if statusword & state.value[0] == state.value[1]), None)


ENABLED_MASK, ENABLED_PATTERN = DriveState.OPERATION_ENABLED.value

_S, _C = DriveState, Controlword
POWERED = frozenset((_S.SWITCHED_ON, _S.OPERATION_ENABLED, _S.QUICK_STOP_ACTIVE, _S.FAULT_REACTION_ACTIVE))
"""States with the power stage on, or about to be."""

TO_OPERATION_ENABLED = {
    _S.NOT_READY_TO_SWITCH_ON: _C.DISABLE_VOLTAGE,
    _S.SWITCH_ON_DISABLED: _C.SHUTDOWN,
    _S.READY_TO_SWITCH_ON: _C.SWITCH_ON,
    _S.SWITCHED_ON: _C.ENABLE_OPERATION,
    _S.OPERATION_ENABLED: _C.ENABLE_OPERATION,
    _S.QUICK_STOP_ACTIVE: _C.DISABLE_VOLTAGE,
    _S.FAULT_REACTION_ACTIVE: _C.DISABLE_VOLTAGE,
    _S.FAULT: _C.FAULT_RESET,
}
"""State -> controlword that brings the drive nearer to operation enabled (transitions 2, 3, 4; 12; 15)."""

TO_SWITCH_ON_DISABLED = {
    _S.NOT_READY_TO_SWITCH_ON: _C.DISABLE_VOLTAGE,
    _S.SWITCH_ON_DISABLED: _C.DISABLE_VOLTAGE,
    _S.READY_TO_SWITCH_ON: _C.DISABLE_VOLTAGE,
    _S.SWITCHED_ON: _C.SHUTDOWN,
    _S.OPERATION_ENABLED: _C.SHUTDOWN,
    _S.QUICK_STOP_ACTIVE: _C.DISABLE_VOLTAGE,
    _S.FAULT_REACTION_ACTIVE: _C.DISABLE_VOLTAGE,
    _S.FAULT: _C.DISABLE_VOLTAGE,
}
"""State -> controlword that brings the drive nearer to switch-on disabled (transitions 8, 6, 7; 12)."""

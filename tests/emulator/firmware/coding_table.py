"""The command coding table of CiA 402-2, which every test of the drive's states reads controlwords by."""

from __future__ import annotations


def command_of(controlword: int) -> str:
    """The command coding table, bit by bit: 7 fault reset, 3 enable, 2 quick stop (low), 1 voltage, 0 switch on."""
    fault_reset, enable, quick_stop, voltage, switch_on = (controlword >> bit & 1 for bit in (7, 3, 2, 1, 0))
    if fault_reset:
        return "fault reset"
    if not voltage:
        return "disable voltage"
    if not quick_stop:
        return "quick stop"
    if not switch_on:
        return "shutdown"
    return "enable operation" if enable else "switch on"

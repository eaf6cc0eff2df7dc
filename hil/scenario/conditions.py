"""Conditions by the names that scenario files have for them, and the keys that each takes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from hil.network.cia import HIGHEST_CAN_ID, DriveState, NmtState
from hil.pytest_plugin.conditions import (
    ANY_ERROR,
    STANDSTILL,
    Condition,
    all_drives,
    at_rest,
    drive,
    emergency,
    frame,
    heartbeat_state,
    moving,
    travelled,
    value_of,
)
from hil.scenario.values import Key, choice, integer, number, role, text
from ident.errors import UserError

_DRIVE_STATE: Final = Key(choice(state.label for state in DriveState))
_NMT_STATE: Final = Key(choice(state.label for state in NmtState))
_NODE: Final = Key(role)
_SPEED: Final = number(0.0, 100.0)
_VALUE: Final = number(-(2.0**32), 2.0**32)

Build = Callable[..., Condition]
"""Makes a condition of the values of its keys, in their order."""


def _frame(id: int, data: str | None) -> Condition:
    try:
        return frame(id, data)
    except ValueError:
        raise UserError(f"data = {data!r} is no data of a frame.", 'Write bytes, "37 06 ?? ??", ?? for any.') from None


def _value(node: str, object: int, subindex: int, at_least: float | None, at_most: float | None) -> Condition:
    if at_least is None and at_most is None:
        raise UserError("value has no bounds.", "Give at_least, at_most, or both.")
    return value_of(node, object, subindex, at_least, at_most)


CONDITIONS: Final[Mapping[str, tuple[Mapping[str, Key], Build]]] = {
    "frame": ({"id": Key(integer(0, HIGHEST_CAN_ID)), "data": Key(text, None)}, _frame),
    "emergency": ({"node": _NODE, "code": Key(integer(0, ANY_ERROR), ANY_ERROR)}, emergency),
    "heartbeat": ({"node": _NODE, "state": _NMT_STATE}, heartbeat_state),
    "drive": ({"node": _NODE, "state": _DRIVE_STATE}, drive),
    "all_drives": ({"state": _DRIVE_STATE}, all_drives),
    "at_rest": ({"speed": Key(_SPEED, STANDSTILL)}, at_rest),
    "moving": ({"faster_than": Key(_SPEED)}, moving),
    "travelled": ({"distance": Key(number(0.0, 1e4))}, travelled),
    "value": (
        {
            "node": _NODE,
            "object": Key(integer(0x1000, 0xFFFF)),
            "subindex": Key(integer(0, 255), 0),
            "at_least": Key(_VALUE, None),
            "at_most": Key(_VALUE, None),
        },
        _value,
    ),
}
"""Name in a file -> its keys, and what makes the condition of them."""

"""What a test can expect: frames, states, motion. Each says in words what it is about, and what was found instead."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import can

from hil.network import DRIVES, Role
from hil.network.cia import NMT_STATE, DriveState, NmtState, Service
from hil.pytest_plugin.world import Observed
from ident.errors import UserError

_NMT_STATES: Final = {int(state): state.label for state in NmtState}
ANY_ERROR: Final = 0xFFFF
"""Stands for every error code but "error reset"."""
STANDSTILL: Final = 0.002
"""Speed that counts as rest [m/s]: the wheels' dry friction holds the vehicle below it."""


@dataclass(frozen=True)
class Condition:
    """Something that holds or does not.

    Attributes:
        text: the condition in words.
        holds: whether it holds now; the second argument is the number of frames seen when the expectation began.
        found: what is the case instead, in words.
    """

    text: str
    holds: Callable[[Observed, int], bool]
    found: Callable[[Observed, int], str]


def frame(can_id: int, data: str | None = None) -> Condition:
    """A frame on the bus, from now on.

    Args:
        can_id: 11-bit identifier.
        data: bytes in hexadecimal, such as `"10 23 ?? 01"`, with `??` for any and the rest of the frame free.
    """
    pattern = None if data is None else [None if byte == "??" else int(byte, 16) for byte in data.split()]

    def matches(message: can.Message) -> bool:
        if message.arbitration_id != can_id or message.is_extended_id or message.is_error_frame:
            return False
        return pattern is None or _starts_with(message.data, pattern)

    return Condition(
        f"a frame {can_id:03X}h" + (f" with data {data}" if data else ""),
        lambda world, since: any(matches(message) for message in world.frames[since:]),
        lambda world, since: _last_frame(world, since, can_id),
    )


def emergency(role: str, code: int = ANY_ERROR) -> Condition:
    """An EMCY message of a node, from now on.

    Args:
        role: of the node, such as `drive_fl`.
        code: its error code, any but "error reset" unless given.
    """
    wanted = _role(role, list(Role))

    def codes(world: Observed, since: int) -> list[int]:
        can_id = Service.EMERGENCY + world.network.node(wanted).node_id
        seen = [message.data for message in world.frames[since:] if message.arbitration_id == can_id]
        return [int(struct.unpack_from("<H", data)[0]) for data in seen if len(data) == 8]

    def holds(world: Observed, since: int) -> bool:
        return any(seen == code or (code == ANY_ERROR and seen != 0) for seen in codes(world, since))

    def found(world: Observed, since: int) -> str:
        seen = codes(world, since)
        return f"it sent {', '.join(f'{one:04X}h' for one in seen)}" if seen else "it sent none"

    which = "an emergency" if code == ANY_ERROR else f"emergency {code:04X}h"
    return Condition(f"{which} of {role}", holds, found)


def heartbeat_state(role: str, state: str) -> Condition:
    """A heartbeat of a node, from now on, that says `operational`, `pre-operational`, `stopped` or `boot-up`."""
    wanted = _role(role, list(Role))
    if state not in _NMT_STATES.values():
        raise UserError(f"There is no NMT state {state!r}.", f"Use one of {', '.join(_NMT_STATES.values())}.")

    def states(world: Observed, since: int) -> list[str]:
        can_id = Service.HEARTBEAT + world.network.node(wanted).node_id
        seen = [message.data for message in world.frames[since:] if message.arbitration_id == can_id]
        return [_NMT_STATES.get(data[0] & NMT_STATE, "unknown") for data in seen if data]

    return Condition(
        f"{role} to say that it is {state}",
        lambda world, since: state in states(world, since),
        lambda world, since: f"it said {', '.join(dict.fromkeys(states(world, since))) or 'nothing'}",
    )


def drive(role: str, state: str) -> Condition:
    """A drive in a state of CiA 402, such as `operation enabled`."""
    return _drives((_role(role, DRIVES),), state, f"{role} to be {state}")


def all_drives(state: str) -> Condition:
    """All four drives in a state of CiA 402."""
    return _drives(DRIVES, state, f"all drives to be {state}")


def at_rest(speed: float = STANDSTILL) -> Condition:
    """The vehicle slower than `speed` [m/s] over the floor."""
    return Condition(
        f"the vehicle to be at rest (below {speed:g} m/s)",
        lambda world, _: world.speed() < speed,
        lambda world, _: f"it moves at {world.speed():.3f} m/s",
    )


def moving(faster_than: float) -> Condition:
    """The vehicle faster than this [m/s] over the floor."""
    return Condition(
        f"the vehicle to be faster than {faster_than:g} m/s",
        lambda world, _: world.speed() > faster_than,
        lambda world, _: f"it moves at {world.speed():.3f} m/s",
    )


def travelled(distance: float, since: tuple[float, float] = (0.0, 0.0)) -> Condition:
    """The chassis centre farther than `distance` [m], as the crow flies, from a point `since` [m, m]."""

    def covered(world: Observed) -> float:
        x, y, _ = world.truth().pose
        return math.hypot(x - since[0], y - since[1])

    return Condition(
        f"the vehicle to travel {distance:g} m",
        lambda world, _: covered(world) > distance,
        lambda world, _: f"it has travelled {covered(world):.3f} m",
    )


def value_of(role: str, index: int, subindex: int, at_least: float | None, at_most: float | None) -> Condition:
    """An object of a node within bounds, read behind the bus, whatever is mapped into its PDOs.

    Args:
        role: of the node.
        index, subindex: of an integer object.
        at_least, at_most: bounds, None for none.
    """
    wanted = _role(role, list(Role))
    low, high = (-math.inf if at_least is None else at_least), (math.inf if at_most is None else at_most)
    bounds = [f"at least {low:g}"] * (at_least is not None) + [f"at most {high:g}"] * (at_most is not None)
    return Condition(
        f"{index:04X}h:{subindex} of {role} to be {' and '.join(bounds)}",
        lambda world, _: low <= world.object_value(wanted, index, subindex) <= high,
        lambda world, _: f"it is {world.object_value(wanted, index, subindex)}",
    )


def _drives(roles: tuple[Role, ...], state: str, text: str) -> Condition:
    wanted = _state(state)

    def found(world: Observed, _since: int) -> str:
        return ", ".join(f"{role} is {_label(world.drive_state(role))}" for role in roles)

    return Condition(text, lambda world, _: all(world.drive_state(role) is wanted for role in roles), found)


def _role(name: str, known: Sequence[Role]) -> Role:
    if name not in known:
        raise UserError(f"There is no {name!r} to expect that of.", f"Use one of {', '.join(known)}.")
    return Role(name)


def _state(label: str) -> DriveState:
    known = {state.label: state for state in DriveState}
    if label not in known:
        raise UserError(f"There is no drive state {label!r}.", f"Use one of {', '.join(known)}.")
    return known[label]


def _label(state: DriveState | None) -> str:
    return "in no known state" if state is None else state.label


def _starts_with(data: bytearray, pattern: list[int | None]) -> bool:
    if len(data) < len(pattern):
        return False
    return all(wanted is None or wanted == byte for wanted, byte in zip(pattern, data, strict=False))


def _last_frame(world: Observed, since: int, can_id: int) -> str:
    last = next((one for one in reversed(world.frames[since:]) if one.arbitration_id == can_id), None)
    if last is None:
        return f"none of the {len(world.frames) - since} frames since then has this identifier"
    return f"the last one held {bytes(last.data).hex(' ') or 'no data'}"

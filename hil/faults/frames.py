"""Faults of frames: what becomes of one frame on its way, as (delay, frame) pairs."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple, Protocol

import numpy as np

from hil.faults.fault import SPECIFICATIONS, Fault, FaultKind
from hil.network.cia import NODE_ID, Service


class Frame(NamedTuple):
    """A data frame on its way between the master and the nodes."""

    can_id: int
    data: bytes
    from_master: bool


Flow = Sequence[tuple[float, Frame]]
"""What comes out of a rule: each frame with its delay [s]."""


class Selection(Protocol):
    """Which frames a rule is about."""

    def __call__(self, frame: Frame) -> bool:
        """Whether this one is."""


def identifiers(low: int, high: int) -> Selection:
    """Frames with an identifier in a closed range."""
    return lambda frame: low <= frame.can_id <= high


def sent_by_node(node_id: int) -> Selection:
    """What a node sends in the predefined connection set (CiA 301, table 38)."""
    return lambda frame: (
        not frame.from_master and frame.can_id >= Service.EMERGENCY and frame.can_id & NODE_ID == node_id
    )


def sent_by_master(frame: Frame) -> bool:
    """What comes from the master's side of the connector."""
    return frame.from_master


def any_frame(frame: Frame) -> bool:
    """Every frame."""
    return True


def heartbeat_of(node_id: int) -> Selection:
    """Boot-up messages and heartbeats of a node, or of the master."""
    return lambda frame: frame.can_id == Service.HEARTBEAT + node_id


@dataclass
class _Held:
    """A frame that waits for later ones to overtake it."""

    frame: Frame
    overtakers: int


class FrameRule:
    """One fault of frames, while it lasts.

    Args:
        fault: what to do.
        selects: to which frames.
        rng: decides which of them, and how.

    Attributes:
        fault, rng: as given.
        held: frames that are held back.
        changed: number of frames that it has befallen.
    """

    def __init__(self, fault: Fault, selects: Selection, rng: np.random.Generator) -> None:
        self.fault = fault
        self.rng = rng
        self.held: list[_Held] = []
        self.changed = 0
        self._selects = selects
        self._change = _CHANGES[fault.kind]
        known = SPECIFICATIONS[fault.kind].parameters
        self._rate = fault.number("rate") if "rate" in known else 1.0
        self._count = fault.number("count") if "count" in known else math.inf

    def __call__(self, frame: Frame) -> Flow:
        """What becomes of a frame."""
        if not self._selects(frame):
            return ((0.0, frame),)
        released = self._overtaken()
        if self.changed >= self._count or (self._rate < 1.0 and self.rng.random() >= self._rate):
            return ((0.0, frame), *released)
        self.changed += 1
        return (*self._change(self, frame), *released)

    def end(self) -> Flow:
        """The fault is over: what it still holds back goes out."""
        held, self.held = self.held, []
        return [(0.0, item.frame) for item in held]

    def _overtaken(self) -> Flow:
        for item in self.held:
            item.overtakers -= 1
        done = [(0.0, item.frame) for item in self.held if item.overtakers <= 0]
        self.held = [item for item in self.held if item.overtakers > 0]
        return done


def _drop(_rule: FrameRule, _frame: Frame) -> Flow:
    return ()


def _delay(rule: FrameRule, frame: Frame) -> Flow:
    jitter = rule.fault.number("jitter")
    return ((rule.fault.number("time") + (jitter * rule.rng.random() if jitter else 0.0), frame),)


def _duplicate(rule: FrameRule, frame: Frame) -> Flow:
    return ((0.0, frame),) * (1 + int(rule.fault.number("copies")))


def _corrupt(rule: FrameRule, frame: Frame) -> Flow:
    size = 8 * len(frame.data)
    flipped = rule.rng.choice(size, min(int(rule.fault.number("bits")), size), replace=False) if size else ()
    value = int.from_bytes(frame.data, "little")
    for bit in flipped:
        value ^= 1 << int(bit)
    return ((0.0, frame._replace(data=value.to_bytes(len(frame.data), "little"))),)


def _reorder(rule: FrameRule, frame: Frame) -> Flow:
    rule.held.append(_Held(frame, int(rule.fault.number("depth"))))
    return ()


def _length(rule: FrameRule, frame: Frame) -> Flow:
    length = min(max(len(frame.data) + int(rule.fault.number("bytes")), 0), 8)
    return ((0.0, frame._replace(data=frame.data[:length].ljust(length, b"\x00"))),)


_CHANGES: Final[Mapping[FaultKind, Callable[[FrameRule, Frame], Flow]]] = {
    FaultKind.DROP: _drop,
    FaultKind.DELAY: _delay,
    FaultKind.DUPLICATE: _duplicate,
    FaultKind.CORRUPT: _corrupt,
    FaultKind.REORDER: _reorder,
    FaultKind.LENGTH: _length,
    FaultKind.HEARTBEAT: _drop,
    FaultKind.DEATH: _drop,
}

FRAME_FAULTS: Final = frozenset(_CHANGES)
"""The kinds that act on frames."""

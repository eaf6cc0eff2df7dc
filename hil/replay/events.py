"""What nodes say beside the values that they sample: messages of which one side has none, or others."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher
from typing import Final

import numpy as np

from hil.network import Node
from hil.replay.parties import Answer, Parties
from hil.replay.playing import Played, Traffic


@dataclass(frozen=True)
class Event:
    """A message that one side has and the other has not, or has with other data.

    Attributes:
        node: who sent it.
        answer: what kind it is.
        recorded_at, emulated_at: when [s]; None where that side has none.
        recorded, emulated: its data.
    """

    node: Node
    answer: Answer
    recorded_at: float | None
    emulated_at: float | None
    recorded: bytes = b""
    emulated: bytes = b""

    @property
    def time(self) -> float:
        """When both began to differ [s]."""
        return min(at for at in (self.recorded_at, self.emulated_at) if at is not None)


def unlike_messages(played: Played, parties: Parties) -> Iterator[Event]:
    """Answers beside those of the SYNC: SDO, EMCY, and changes of the NMT state."""
    one, other = _spoken(played.recorded, parties), _spoken(played.emulated, parties)
    for can_id in sorted({*one, *other}):
        node, answer = parties.sender(can_id), parties.kind(can_id)
        # Who recorded no heartbeats at all has left them out; emergencies there may have been none.
        kept = can_id in one or answer is Answer.EMERGENCY
        if node is not None and kept:
            yield from _unlike(node, answer, one.get(can_id, []), other.get(can_id, []))


_LONGEST: Final = 4000
"""Messages of one identifier that are aligned."""

Spoken = list[tuple[float, bytes]]
"""Messages of one identifier: instant [s] and data."""


def _spoken(traffic: Traffic, parties: Parties) -> dict[int, Spoken]:
    found: dict[int, Spoken] = {}
    for time, can_id, data in zip(traffic.time, traffic.can_id, traffic.data, strict=True):
        if parties.sender(can_id) is None or can_id in parties.samples:
            continue
        said = found.setdefault(can_id, [])
        # How often a node repeats its state is a matter of its timer; what counts is when the state changes.
        if not (parties.kind(can_id) is Answer.STATE and said and said[-1][1] == data):
            said.append((time, data))
    return found


def _unlike(node: Node, answer: Answer, one: Spoken, other: Spoken) -> Iterator[Event]:
    for kind, a, b, c, d in _changes([data for _, data in one], [data for _, data in other]):
        if kind == "equal":
            continue
        for k in range(max(b - a, d - c)):
            mine, theirs = _at(one, a + k, b), _at(other, c + k, d)
            yield Event(node, answer, mine[0], theirs[0], mine[1], theirs[1])


def _changes(one: Sequence[bytes], other: Sequence[bytes]) -> Iterator[tuple[str, int, int, int, int]]:
    """How one sequence becomes the other; very long ones are taken one by one, for aligning takes their square."""
    if max(len(one), len(other)) <= _LONGEST:
        yield from SequenceMatcher(None, one, other, autojunk=False).get_opcodes()
        return
    shared = min(len(one), len(other))
    yield from (("replace", k, k + 1, k, k + 1) for k in range(shared) if one[k] != other[k])
    yield "replace", shared, len(one), shared, len(other)


def _at(messages: Spoken, position: int, end: int) -> tuple[float | None, bytes]:
    return messages[position] if position < end else (None, b"")


def missing_samples(played: Played, parties: Parties) -> Iterator[Event]:
    """Where a PDO begins to be there on one side alone, or with another length."""
    for can_id, (node, _) in parties.samples.items():
        one, other = _by_cycle(played.recorded, can_id), _by_cycle(played.emulated, can_id)
        alone = sorted(cycle for cycle in {*one, *other} if _length(one, cycle) != _length(other, cycle))
        begun = [cycle for cycle, before in zip(alone, [None, *alone], strict=False) if cycle - 1 != before]
        for cycle in begun:
            mine, theirs = one.get(cycle, (None, b"")), other.get(cycle, (None, b""))
            yield Event(node, Answer.SAMPLE, mine[0], theirs[0], mine[1], theirs[1])


def _by_cycle(traffic: Traffic, can_id: int) -> dict[int, tuple[float, bytes]]:
    rows = np.flatnonzero(np.asarray(traffic.can_id) == can_id)
    return {traffic.cycle[row]: (traffic.time[row], traffic.data[row]) for row in reversed(rows.tolist())}


def _length(side: dict[int, tuple[float, bytes]], cycle: int) -> int | None:
    return len(side[cycle][1]) if cycle in side else None

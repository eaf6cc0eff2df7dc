"""Answers of two sides beside each other: what nodes sample with the SYNC, object by object, and what else they say."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from hil.frames import FrameTable
from hil.network import MappedObject, Network, Node, Pdo
from hil.network.cia import Index
from hil.replay.events import Event, missing_samples, unlike_messages
from hil.replay.parties import Answer, Parties
from hil.replay.playing import Played, Traffic, table_of

Array = NDArray[np.float64]
Counts = NDArray[np.int64]

SPREADS: Final = 2.0
"""Times what emulations differ among themselves, from which a difference to the record is one."""


AHEAD: Final = 125
"""Samples beyond one that tell how much emulations differ at it: 0.25 s at 500 Hz."""


@dataclass(frozen=True)
class Track:
    """One object of one node, as often as both sides have sampled it.

    Attributes:
        node: whose it is.
        item: the object.
        unit: what one count is worth, and in what [rad, Nm]; a factor 1 and no unit for words of bits.
        cycle: (N,) number of the SYNC that each sample belongs to.
        time: (N,) on the axis of the replay [s].
        recorded, emulated: (N,) counts; wrapped counters continued.
        tolerance: (N,) counts by which both may differ for no reason.
    """

    node: Node
    item: MappedObject
    unit: tuple[float, str]
    cycle: Counts
    time: Array
    recorded: Counts
    emulated: Counts
    tolerance: Array

    @cached_property
    def difference(self) -> Counts:
        """(N,) emulated less recorded [counts]; of words of bits, the bits that differ."""
        if self.is_bits:
            return self.emulated ^ self.recorded
        return self.emulated - self.recorded

    @cached_property
    def differing(self) -> NDArray[np.intp]:
        """Rows in which both differ by more than the tolerance."""
        return np.flatnonzero(np.abs(self.difference) > self.tolerance)

    @property
    def is_bits(self) -> bool:
        """A word of bits, and no quantity."""
        return not self.unit[1]

    @property
    def label(self) -> str:
        """The object, in words."""
        return f"{self.item.index:04X}h {self.item.name}"

    @property
    def largest(self) -> int:
        """Row of the largest difference."""
        return int(np.argmax(np.abs(self.difference)))

    def text(self, count: int) -> str:
        """A value as people read it: a word of bits in hexadecimal, a quantity in its unit and raw."""
        if self.is_bits:
            return f"{count & (1 << self.item.bits) - 1:0{self.item.bits // 4}X}h"
        return f"{count * self.unit[0]:.6g} {self.unit[1]} ({count})"


@dataclass(frozen=True)
class Compared:
    """What came of a comparison.

    Attributes:
        tracks: every object of every node that is sampled with the SYNC.
        events: messages that differ, in the order of time.
        answers: frames of the nodes that were recorded.
        equal: those that the emulated nodes have answered with the same identifier, in the same cycle, to the bit.
        latest: largest difference between the instants of such a pair [s].
    """

    tracks: tuple[Track, ...]
    events: tuple[Event, ...]
    answers: int
    equal: int
    latest: float

    @property
    def agrees(self) -> bool:
        """No difference beyond the tolerances."""
        return not self.events and not any(len(track.differing) for track in self.tracks)

    @property
    def identical(self) -> bool:
        """Every frame, to the bit."""
        return self.equal == self.answers and not self.events

    def ranked(self) -> list[Track]:
        """Tracks that differ, in the order in which they began to, the larger first among those of one cycle."""
        differing = [track for track in self.tracks if len(track.differing)]
        return sorted(differing, key=lambda track: (int(track.cycle[track.differing[0]]), -_times(track)))


def _times(track: Track) -> float:
    """The first difference, as many times what it might have been for no reason."""
    first = track.differing[0]
    return float(abs(track.difference[first]) / max(track.tolerance[first], 0.5))


def compare(played: Played, others: Sequence[Played], network: Network) -> Compared:
    """What was recorded beside what was emulated.

    Args:
        played: the emulation that is shown.
        others: emulations of the same vehicle with other noise: what they differ by says nothing.
        network: the network file.
    """
    parties = Parties(network)
    recorded, emulated = table_of(played.recorded), table_of(played.emulated)
    tracks: list[Track] = []
    for node, pdo in parties.samples.values():
        sides = [(recorded, played.recorded), (emulated, played.emulated)]
        sides += [(table_of(other.emulated), other.emulated) for other in others]
        tracks += _tracks(node, pdo, sides)
    equal, latest = _equal(recorded, emulated, played, parties)
    events = sorted(
        (*unlike_messages(played, parties), *missing_samples(played, parties)), key=lambda event: event.time
    )
    return Compared(tuple(tracks), tuple(events), len(recorded), equal, latest)


def _tracks(node: Node, pdo: Pdo, sides: Sequence[tuple[FrameTable, Traffic]]) -> Iterator[Track]:
    can_id, size = pdo.cob_id(node.node_id), sum(item.bits for item in pdo.objects) // 8
    rows = [_first_of_cycles(table, traffic, can_id, size) for table, traffic in sides]
    shared = rows[0][0]
    for cycles, _ in rows[1:]:
        shared = np.intersect1d(shared, cycles)
    if not len(shared):
        return
    taken = [at[np.searchsorted(cycles, shared)] for cycles, at in rows]
    time = sides[0][0].time[taken[0]]
    offset = 0
    for item in pdo.objects:
        values = [_values(table, at, item, offset, node) for (table, _), at in zip(sides, taken, strict=True)]
        offset += item.bits // 8
        unit = _unit(node, item)
        # A state that is another one is a difference, whatever others do.
        tolerance = _tolerance(values[1:]) if unit[1] else np.zeros(len(shared))
        yield Track(node, item, unit, shared, time, values[0], values[1], tolerance)


def _first_of_cycles(table: FrameTable, traffic: Traffic, can_id: int, size: int) -> tuple[Counts, NDArray[np.intp]]:
    """Numbers of the SYNCs that a PDO came after, and the rows of its first frame after each."""
    rows = np.flatnonzero((table.can_id == can_id) & (table.length == size))
    cycles, first = np.unique(np.asarray(traffic.cycle, dtype=np.int64)[rows], return_index=True)
    return cycles, rows[first]


def _values(table: FrameTable, rows: NDArray[np.intp], item: MappedObject, offset: int, node: Node) -> Counts:
    raw = np.ascontiguousarray(table.data[rows, offset : offset + item.bits // 8])
    values = raw.view(f"<{item.code}").ravel().astype(np.int64)
    if item.index not in _POSITIONS or not len(values):
        return values
    half, modulus = node.counter_modulus // 2, node.counter_modulus
    # A count near the end of the range and one behind it are neighbours, on both sides alike.
    start = (values[0] - node.zero_counts + half) % modulus - half
    steps = (np.diff(values) + half) % modulus - half
    return np.concatenate([[start], start + np.cumsum(steps)])


def _unit(node: Node, item: MappedObject) -> tuple[float, str]:
    if item.index in _POSITIONS:
        return node.angle_unit, "rad"
    if item.index in _TORQUES:
        return node.torque_unit, "Nm"
    return 1.0, ""


def _tolerance(emulations: Sequence[Counts]) -> Array:
    """Largest difference among emulations so far (N,): what began as noise may grow, and never is less again.

    So far, and a little beyond: the first samples alone do not show how much noise there is.
    """
    spread = np.max(emulations, axis=0) - np.min(emulations, axis=0)
    if len(emulations) == 1:
        return np.asarray(spread, dtype=np.float64)
    largest = np.maximum.accumulate(spread)
    return np.asarray(SPREADS * largest[np.minimum(np.arange(len(largest)) + AHEAD, len(largest) - 1)] + 1.0)


_POSITIONS: Final = (Index.POSITION_ACTUAL, Index.ENCODER_POSITION)
_TORQUES: Final = (Index.TORQUE_ACTUAL, Index.TORQUE_DEMAND, Index.TARGET_TORQUE)


def _equal(recorded: FrameTable, emulated: FrameTable, played: Played, parties: Parties) -> tuple[int, float]:
    """Recorded answers that have an emulated twin, and how far apart in time such twins are at most [s]."""
    equal, latest = 0, 0.0
    for can_id in np.unique(recorded.can_id).tolist():
        one, other = (np.flatnonzero(table.can_id == can_id) for table in (recorded, emulated))
        if parties.kind(can_id) is Answer.SAMPLE:
            _, a, b = np.intersect1d(
                np.asarray(played.recorded.cycle)[one], np.asarray(played.emulated.cycle)[other], return_indices=True
            )
            one, other = one[a], other[b]
        else:
            pairs = min(len(one), len(other))
            one, other = one[:pairs], other[:pairs]
        same = (recorded.length[one] == emulated.length[other]) & (recorded.data[one] == emulated.data[other]).all(
            axis=1
        )
        equal += int(same.sum())
        apart = np.abs(recorded.time[one] - emulated.time[other])[same]
        latest = max(latest, float(apart.max())) if len(apart) else latest
    return equal, latest

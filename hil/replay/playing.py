"""Plays what others than the nodes have sent into a bench, and keeps what its nodes answer.

Two ways to let time pass. *In step*: a log of a master that was in lockstep with the emulator, in the order in which
that master sent and read; the bench then does what it did, to the bit. *By stamps*: any other log; SYNCs come on the
grid of the cycle period, other frames as long after the SYNC as their stamps say.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Final

import can
import numpy as np

from hil.bench.lockstep import LockstepBench
from hil.frames import FrameTable
from hil.network import Network
from hil.replay.parties import Parties
from hil.replay.recording import Part, Recording
from ident.errors import RecordError

_STAMP_ERROR: Final = 1e-6
"""What a stamp may be off by rounding [s]."""

_MILLISECOND: Final = 1e3
"""BLF keeps simulated stamps from the millisecond on in which the file began."""

_LONGEST_PAUSE: Final = 600.0
"""Time without a SYNC beyond which a clock was set rather than nothing happened [s]."""

Told = Callable[[str, int, int], None]
"""Called with the part that is played, frames done, and frames in all."""


Before = Callable[[str, int, bytes], None]
"""Called with part, identifier and data before each frame of the master."""


@dataclass
class Traffic:
    """Frames of one side: instants on the axis of the replay [s], identifiers, data, and the SYNC before each."""

    time: list[float] = field(default_factory=list)
    can_id: list[int] = field(default_factory=list)
    data: list[bytes] = field(default_factory=list)
    cycle: list[int] = field(default_factory=list)

    def add(self, time: float, can_id: int, data: bytes, cycle: int) -> None:
        """One more frame."""
        self.time.append(time)
        self.can_id.append(can_id)
        self.data.append(data)
        self.cycle.append(cycle)


@dataclass(frozen=True)
class Mark:
    """Where a part begins on the axis of the replay [s], and its stamp there [s]."""

    name: str
    time: float
    stamp: float


@dataclass
class Played:
    """Both sides of a replay.

    Attributes:
        recorded, emulated: answers of the nodes.
        marks: of the parts.
        syncs: SYNCs that were played.
        others: frames of the master, and of whoever is not in the network file.
    """

    recorded: Traffic = field(default_factory=Traffic)
    emulated: Traffic = field(default_factory=Traffic)
    marks: list[Mark] = field(default_factory=list)
    syncs: int = 0
    others: int = 0


class Player:
    """A bench into which a recording is played.

    Args:
        bench: the bench.
        network: its network file.
        told: progress.
    """

    def __init__(self, bench: LockstepBench, network: Network, told: Told = lambda *_: None) -> None:
        self._bench = bench
        self._sync = network.sync_cob_id
        self._period = network.cycle_period
        self._parties = Parties(network)
        self._told = told
        self._origin = 0.0
        self.played = Played()

    def in_step(self, recording: Recording, before_frame: Before) -> Played:
        """Play a log of a master that was in lockstep.

        Args:
            recording: what was recorded.
            before_frame: called with part, identifier and data before each frame of the master; hands that lift.
        """
        for part in recording.parts:
            late: float | None = None
            for number, (stamp, can_id, data) in enumerate(part.frames()):
                if self._parties.sender(can_id) is None:
                    before_frame(part.name, can_id, data)
                    sent = self._send(can_id, data)
                    if late is None:
                        late = self._begin(part, sent, stamp)
                    continue
                if late is None:
                    late = self._begin(part, self._bench.clock.now(), part.start)
                # A master that has waited for this answer has waited until it was there, and no longer.
                self._read(max(stamp + late + _STAMP_ERROR - self._bench.clock.now(), 0.0))
                self._keep(stamp + late, can_id, data)
                if not number % _REPORT:
                    self._told(part.name, number, len(part.table))
            self._told(part.name, len(part.table), len(part.table))
        self._drain()
        return self.played

    def by_stamps(self, recording: Recording, before_frame: Before) -> Played:
        """Play any other log; the clock of the bench goes on from where it is.

        Args:
            recording, before_frame: as for `in_step`.

        Raises:
            RecordError: the clock of the log was set while it was recorded.
        """
        parts = tuple(part.in_time() for part in recording.parts)
        _refuse_pauses(recording.source, parts)
        begin, first = round(self._bench.clock.now() + self._period, 9), parts[0].start
        grid = _Grid(begin, first, self._period)
        self._origin = begin
        for part in parts:
            self.played.marks.append(Mark(part.name, part.start - first, part.start))
            for number, (stamp, can_id, data) in enumerate(part.frames()):
                instant = grid.instant(stamp, can_id == self._sync)
                if self._parties.sender(can_id) is None:
                    self._bench.clock.wait_until(instant)
                    before_frame(part.name, can_id, data)
                    self._send(can_id, data)
                else:
                    self._keep(instant - begin, can_id, data)
                if not number % _REPORT:
                    self._told(part.name, number, len(part.table))
            self._told(part.name, len(part.table), len(part.table))
        self._bench.clock.wait_until(round(grid.last + self._period / 2, 9))
        self._drain()
        return self.played

    def _begin(self, part: Part, now: float, stamp: float) -> float:
        """From stamps of a part to the axis of the replay [s]."""
        late = round((now - stamp) * _MILLISECOND) / _MILLISECOND
        self.played.marks.append(Mark(part.name, part.start + late, part.start))
        return late

    def _send(self, can_id: int, data: bytes) -> float:
        """Give the bench a frame; its stamp [s]."""
        if can_id == self._sync:
            self._drain()
        message = can.Message(arbitration_id=can_id, data=data, is_extended_id=False)
        self._bench.bus.send(message)
        self.played.others += 1
        self.played.syncs += can_id == self._sync
        return float(message.timestamp)

    def _keep(self, time: float, can_id: int, data: bytes) -> None:
        self.played.recorded.add(time, can_id, data, self.played.syncs)

    def _read(self, timeout: float) -> bool:
        message = self._bench.bus.recv(timeout)
        if message is None:
            return False
        if not (message.is_error_frame or message.is_extended_id):
            instant = message.timestamp - self._origin
            self.played.emulated.add(instant, message.arbitration_id, bytes(message.data), self.played.syncs)
        return True

    def _drain(self) -> None:
        while self._read(0.0):
            pass


_REPORT: Final = 2000
"""Frames between two reports of progress."""


class _Grid:
    """From stamps to instants: SYNCs on the grid of the period, other frames as long after them as they were.

    Args:
        begin: instant of the first frame [s].
        stamp: its stamp [s].
        period: between SYNCs [s].
    """

    def __init__(self, begin: float, stamp: float, period: float) -> None:
        self._period = period
        self._instant, self._stamp = begin, stamp
        self._synced = False
        self.last = begin

    def instant(self, stamp: float, is_sync: bool) -> float:
        """Where a frame belongs; never before the one before it."""
        passed = stamp - self._stamp
        if not is_sync:
            inside = min(passed, self._period - _STAMP_ERROR) if self._synced and passed < 2 * self._period else passed
            self.last = max(round(self._instant + inside, 9), self.last)
            return self.last
        if self._synced:
            # Whole periods: a SYNC that is late by some of one samples where it would have been on time.
            passed = max(round(passed / self._period), 1) * self._period
        self._instant, self._stamp, self._synced = round(self._instant + passed, 9), stamp, True
        self.last = max(self._instant, self.last)
        return self.last


def _refuse_pauses(source: str, parts: Sequence[Part]) -> None:
    stamps = np.concatenate([part.table.time for part in parts])
    longest = int(np.argmax(np.diff(stamps))) if len(stamps) > 1 else 0
    if len(stamps) > 1 and stamps[longest + 1] - stamps[longest] > _LONGEST_PAUSE:
        pause = stamps[longest + 1] - stamps[longest]
        raise RecordError(
            f"{source}: nothing was recorded for {pause:.0f} s after frame {longest}; its clock may have been set.",
            "Split the log there, and replay its parts one by one.",
        )


def table_of(traffic: Traffic) -> FrameTable:
    """Frames as columns."""
    payload = b"".join(data[:8].ljust(8, b"\0") for data in traffic.data)
    return FrameTable(
        np.array(traffic.time, dtype=np.float64),
        np.array(traffic.can_id, dtype=np.uint32),
        np.array([len(data) for data in traffic.data], dtype=np.uint8),
        np.frombuffer(payload, np.uint8).reshape(-1, 8),
    )


def part_at(marks: Sequence[Mark], time: float) -> tuple[Mark, float]:
    """The part that an instant of the replay [s] is in, and the time since its first frame [s]."""
    found = marks[0]
    for _, after in pairwise(marks):
        if after.time <= time + _STAMP_ERROR:
            found = after
    return found, time - found.time

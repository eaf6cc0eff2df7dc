"""When a loop was where, on the clock that all processes of a computer share, and how long it has run until then."""

from __future__ import annotations

import csv
import enum
import gc
import time
from array import array
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ident.errors import RecordError

try:
    from resource import RUSAGE_THREAD, getrusage
except ImportError:  # no Linux

    def page_faults() -> int:
        """Not told here."""
        return 0
else:

    def page_faults() -> int:
        """Pages that this thread touched and the kernel had to fetch first, so far."""
        usage = getrusage(RUSAGE_THREAD)
        return usage.ru_minflt + usage.ru_majflt


ROOM: Final = 1 << 20
"""Stamps that are kept: the newest; 32 MB."""

_HEADER: Final = ("moment", "monotonic_s", "thread_time_s", "page_faults")


class Moment(enum.IntEnum):
    """Where a loop is."""

    DUE = 0
    """The instant at which the master wants to send a SYNC; stamped with that, not with when it said so."""
    RESTS = 1
    """The master begins to wait for it,"""
    AWAKE = 2
    """has waited,"""
    SYNC_SENT = 3
    """has handed the SYNC to the bus,"""
    HEARD = 4
    """and has all answers."""
    LISTENS = 5
    """The server has done what there was to be done, and waits for a frame."""
    ROUSED = 6
    """It got one, or its patience is over."""
    SYNC_TAKEN = 7
    """It got a SYNC,"""
    MOVED = 8
    """and has moved the vehicle up to it. The answers are sent when it listens again."""
    COLLECTS = 9
    """Python looks for garbage,"""
    COLLECTED = 10
    """and has done so."""


@dataclass(frozen=True)
class Stamped:
    """Stamps of a thread, in their order.

    Attributes:
        moment: (n,) of `Moment`.
        wall: (n,) monotonic clock of the computer [s].
        cpu: (n,) time that the thread has run [s].
        faults: (n,) pages that it waited for.
    """

    moment: NDArray[np.int8]
    wall: NDArray[np.float64]
    cpu: NDArray[np.float64]
    faults: NDArray[np.float64]

    def where(self, *moments: Moment) -> NDArray[np.intp]:
        """Positions of some moments, in order."""
        return np.flatnonzero(np.isin(self.moment, moments))


class Stamps:
    """Takes stamps; it allocates nothing while it does.

    Args:
        room: how many are kept; the oldest are overwritten.
        wall, cpu, faults: read at each stamp.
    """

    def __init__(
        self,
        room: int = ROOM,
        wall: Callable[[], float] = time.monotonic,
        cpu: Callable[[], float] = time.thread_time,
        faults: Callable[[], int] = page_faults,
    ) -> None:
        self._room = room
        self._count = 0
        self._read = wall, cpu, faults
        self._moment = array("b", bytes(room))
        self._wall, self._cpu, self._faults = (array("d", bytes(8 * room)) for _ in range(3))

    def stamp(self, moment: Moment) -> None:
        """Now the thread is there."""
        wall, cpu, faults = self._read
        self._put(moment, wall(), cpu(), faults())

    def stamp_due(self, instant: float) -> None:
        """The next SYNC is due at an instant of the monotonic clock [s]."""
        _, cpu, faults = self._read
        self._put(Moment.DUE, instant, cpu(), faults())

    def table(self) -> Stamped:
        """All that are kept."""
        begin, end = max(self._count - self._room, 0), self._count
        order = np.arange(begin, end) % self._room
        columns = (np.array(column)[order] for column in (self._wall, self._cpu, self._faults))
        return Stamped(np.array(self._moment, dtype=np.int8)[order], *columns)

    def _put(self, moment: int, wall: float, cpu: float, faults: int) -> None:
        at = self._count % self._room
        self._moment[at], self._wall[at], self._cpu[at], self._faults[at] = moment, wall, cpu, faults
        self._count += 1

    @contextmanager
    def collections(self) -> Iterator[None]:
        """Inside, collections of garbage are stamped."""

        def tell(phase: str, _: dict[str, Any]) -> None:
            self.stamp(Moment.COLLECTS if phase == "start" else Moment.COLLECTED)

        gc.callbacks.append(tell)
        try:
            yield
        finally:
            gc.callbacks.remove(tell)


def write_stamps(table: Stamped, path: Path) -> None:
    """As CSV, one stamp a line, moments by name.

    Raises:
        OSError: the file cannot be written.
    """
    names = [moment.name.lower() for moment in Moment]
    rows = zip(table.moment.tolist(), table.wall.tolist(), table.cpu.tolist(), table.faults.tolist(), strict=True)
    with path.open("w", newline="", encoding="ascii") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(_HEADER)
        out.writerows((names[moment], f"{wall:.7f}", f"{cpu:.7f}", int(faults)) for moment, wall, cpu, faults in rows)


def read_stamps(path: Path) -> Stamped:
    """What `write_stamps` wrote.

    Raises:
        RecordError: the file cannot be read, or holds something else.
    """
    try:
        with path.open(newline="", encoding="ascii") as file:
            rows = list(csv.reader(file))
        if tuple(rows[0]) != _HEADER:
            raise ValueError(rows[0])
        moments = np.array([Moment[row[0].upper()] for row in rows[1:]], dtype=np.int8)
        numbers = np.array([row[1:] for row in rows[1:]], dtype=np.float64).reshape(-1, 3)
    except (OSError, ValueError, KeyError, IndexError) as error:
        raise RecordError(f"{path} holds no stamps: {error}.", "Name what `emulate --trace` has written.") from error
    return Stamped(moments, numbers[:, 0], numbers[:, 1], numbers[:, 2])

"""Cycles that come late, and the reasons for it that stamps of master and server tell.

A cycle is late by what its last answer comes later after the instant at which its SYNC is due than the answers of an
undisturbed cycle. Its time falls into parts: the master waits, wakes and sends, the server waits, wakes, moves the
vehicle and answers, the master hears. What a part takes beyond its median is what it has to answer for; where somebody
was at work, the time of the thread says whether it had a processor.
"""

from __future__ import annotations

import csv
import enum
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

LATE: Final = 0.001
"""From which on a cycle is called late [s]."""

UNDISTURBED: Final = 0.05
"""Quantile of all cycles that stands for an undisturbed one."""

Floats = NDArray[np.float64]


class Reason(enum.StrEnum):
    """What made a cycle late."""

    CYCLE_BEFORE = "cycle before"
    MASTER_WOKE_LATE = "master woke late"
    MASTER_NOT_RUNNING = "master not running"
    MASTER_COMPUTING = "master computing"
    MASTER_COLLECTING = "master collecting garbage"
    MASTER_FETCHING = "master waiting for memory"
    MASTER_HEARD_LATE = "master heard late"
    SERVER_WOKE_LATE = "server woke late"
    SERVER_NOT_RUNNING = "server not running"
    SERVER_COMPUTING = "server computing"
    SERVER_COLLECTING = "server collecting garbage"
    SERVER_FETCHING = "server waiting for memory"
    PHYSICS = "physics computing"
    UNKNOWN = "unknown"


MEANINGS: Final[Mapping[Reason, str]] = MappingProxyType(
    {
        Reason.CYCLE_BEFORE: "was late, and this one began after it",
        Reason.MASTER_WOKE_LATE: "the kernel let it sleep on: another program or the kernel itself had the processor",
        Reason.MASTER_NOT_RUNNING: "it wanted to, and another program had the processor",
        Reason.MASTER_COMPUTING: "between two cycles, or interrupted by the kernel or the host of a virtual machine",
        Reason.MASTER_COLLECTING: "Python's collector of garbage",
        Reason.MASTER_FETCHING: "pages that the kernel had to fetch",
        Reason.MASTER_HEARD_LATE: "the answers were there, and it slept on",
        Reason.SERVER_WOKE_LATE: "the SYNC was there, and the kernel let it sleep on",
        Reason.SERVER_NOT_RUNNING: "it wanted to, and another program had the processor",
        Reason.SERVER_COMPUTING: "other frames or the answers, or interrupted by the kernel or the host",
        Reason.SERVER_COLLECTING: "Python's collector of garbage",
        Reason.SERVER_FETCHING: "pages that the kernel had to fetch",
        Reason.PHYSICS: "the vehicle moved up to the SYNC, or interrupted by the kernel or the host",
        Reason.UNKNOWN: "no part of the cycle was much longer than usual",
    }
)


@dataclass(frozen=True)
class LateCycle:
    """One of them; instants are from the one on at which its SYNC was due [s].

    Attributes:
        number: of the cycle.
        due: monotonic clock [s].
        late: [s].
        reason: with the largest part in it.
        share: of that reason in its lateness [s].
        rests, awake, sent, taken, moved, answered, heard: see `Moment`; `answered`: the server listens again.
        ran: time for which the server has run from `taken` to `moved` and from there to `answered` [s].
    """

    number: int
    due: float
    late: float
    reason: Reason
    share: float
    rests: float
    awake: float
    sent: float
    taken: float
    moved: float
    answered: float
    heard: float
    ran: tuple[float, float]


@dataclass(frozen=True)
class Lateness:
    """Of a run.

    Attributes:
        late: (n,) lateness of each cycle [s], of some cycles below zero.
        cycles: those that are late by more than `LATE`.
    """

    late: Floats
    cycles: tuple[LateCycle, ...]


_COLUMNS: Final = ("rests", "awake", "sent", "taken", "moved", "answered", "heard")


def write_late_cycles(cycles: Sequence[LateCycle], path: Path) -> None:
    """As CSV, one a line; instants in milliseconds from the one on at which the SYNC was due.

    Raises:
        OSError: the file cannot be written.
    """
    with path.open("w", newline="", encoding="ascii") as file:
        out = csv.writer(file, lineterminator="\n")
        spent = ("server_moving_ran_ms", "server_answering_ran_ms")
        out.writerow(("cycle", "due_s", "late_ms", "reason", "reason_ms", *(f"{name}_ms" for name in _COLUMNS), *spent))
        for one in cycles:
            times = (one.share, *(getattr(one, name) for name in _COLUMNS), *one.ran)
            shown = (f"{1e3 * value:.3f}" for value in times)
            out.writerow((one.number, f"{one.due:.6f}", f"{1e3 * one.late:.3f}", one.reason, *shown))

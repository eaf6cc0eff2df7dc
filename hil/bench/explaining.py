"""Why cycles come late: the stamps of both sides, laid beside each other cycle by cycle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from hil.bench.lateness import LATE, UNDISTURBED, Floats, LateCycle, Lateness, Reason
from hil.bus.stamps import Moment, Stamped
from ident.errors import RecordError

_FAULT: Final = 1e-4
"""Longest that the kernel takes to fetch a page that it has [s]; on a virtual machine some tens of microseconds."""

_ASLEEP: Final = 2e-5
"""Longest time in which a frame that is there already is taken [s]."""


@dataclass(frozen=True)
class _Party:
    """What holds up a thread that wants to run."""

    not_running: Reason
    collecting: Reason
    fetching: Reason
    computing: Reason


_MASTER: Final = _Party(
    Reason.MASTER_NOT_RUNNING, Reason.MASTER_COLLECTING, Reason.MASTER_FETCHING, Reason.MASTER_COMPUTING
)
_SERVER: Final = _Party(
    Reason.SERVER_NOT_RUNNING, Reason.SERVER_COLLECTING, Reason.SERVER_FETCHING, Reason.SERVER_COMPUTING
)
_PHYSICS: Final = _Party(Reason.SERVER_NOT_RUNNING, Reason.SERVER_COLLECTING, Reason.SERVER_FETCHING, Reason.PHYSICS)


@dataclass(frozen=True)
class _Work:
    """Time in which a thread wanted to run.

    Attributes:
        wall, cpu, collecting: how long it took, ran, and collected garbage [s].
        faults: pages it waited for.
    """

    wall: Floats
    cpu: Floats
    collecting: Floats
    faults: Floats


def explain(master: Stamped, server: Stamped) -> Lateness:
    """The lateness of each cycle, and its reason where it is late.

    Args:
        master: stamps of it.
        server: stamps of it, of the same computer; those that belong to no cycle of the master do no harm.

    Raises:
        RecordError: they are not of the same cycles.
    """
    cycles = _Cycles(master, server)
    spans = cycles.heard - cycles.due
    late = spans - float(np.quantile(spans, UNDISTURBED))
    charges = cycles.charges()
    found = []
    for k in np.flatnonzero(late > LATE):
        shares = {reason: float(charge[k]) for reason, charge in charges.items()}
        reason = max(shares, key=shares.__getitem__)
        if sum(shares.values()) < late[k] / 2:
            reason, shares[Reason.UNKNOWN] = Reason.UNKNOWN, float(late[k])
        found.append(cycles.one(int(k), float(late[k]), reason, shares[reason]))
    return Lateness(late, tuple(found))


class _Cycles:
    """Both sides' stamps by cycle."""

    def __init__(self, master: Stamped, server: Stamped) -> None:
        self._master, self._server = master, server
        heard = master.where(Moment.HEARD)
        if len(heard) < 2:
            raise RecordError("The master's stamps hold no two cycles.", "Let it drive for longer.")
        before, heard = heard[:-1], heard[1:]
        self._before, self._heard = before, heard
        # A master that left cycles out has waited twice: what counts is the instant that it missed.
        self._rests = _next(master.where(Moment.RESTS), before)
        self._due = _next(master.where(Moment.DUE), before)
        self._awake = _last(master.where(Moment.AWAKE), heard)
        self._sent = _last(master.where(Moment.SYNC_SENT), heard)
        syncs = server.where(Moment.SYNC_TAKEN)
        # On another processor the SYNC may be taken before the master has returned from sending it.
        answers = np.searchsorted(server.wall[syncs], master.wall[heard]) - 1
        if len(syncs) == 0 or (answers < 0).any() or (server.wall[syncs[answers]] < master.wall[self._rests]).any():
            raise RecordError(
                "The server's stamps are not of the cycles of the master's.", "Take those of one run on one computer."
            )
        self._taken = syncs[answers]
        self._moved = _next(server.where(Moment.MOVED), self._taken)
        listens = server.where(Moment.LISTENS)
        self._answered = _next(listens, self._moved)
        self._listened = _last(listens, self._taken)
        self.due, self.heard = master.wall[self._due], master.wall[heard]

    def charges(self) -> dict[Reason, Floats]:
        """What each reason has to answer for, cycle by cycle (n,) [s]."""
        wall, theirs = self._master.wall, self._server.wall
        carried = np.maximum(wall[self._before] - self.due, 0.0)
        began = np.maximum(wall[self._before], self.due)
        charges = {
            Reason.CYCLE_BEFORE: carried,
            Reason.MASTER_WOKE_LATE: _excess(wall[self._awake] - np.maximum(self.due, wall[self._rests])),
            Reason.MASTER_HEARD_LATE: _excess(self.heard - np.maximum(theirs[self._answered], wall[self._sent])),
            Reason.SERVER_WOKE_LATE: _excess(self._slept_on()),
        }
        for reason in Reason:
            charges.setdefault(reason, np.zeros(len(self.due)))
        overdue = np.maximum(wall[self._rests] - began, 0.0)
        self._charge(charges, _MASTER, self._work(self._master, self._before, self._rests), overdue)
        self._charge(charges, _MASTER, self._work(self._master, self._awake, self._sent))
        # Before it listened for the SYNC, the server may have been at other frames, or away.
        waited = np.maximum(theirs[self._listened] - np.maximum(wall[self._sent], theirs[self._woken()]), 0.0)
        self._charge(charges, _SERVER, self._work(self._server, self._woken(), self._listened), waited)
        self._charge(charges, _PHYSICS, self._work(self._server, self._taken, self._moved))
        self._charge(charges, _SERVER, self._work(self._server, self._moved, self._answered))
        return charges

    def one(self, k: int, late: float, reason: Reason, share: float) -> LateCycle:
        """A cycle that is late."""
        due, ours, theirs = float(self.due[k]), self._master, self._server

        def ran(begin: NDArray[np.intp], end: NDArray[np.intp]) -> float:
            return float(theirs.cpu[end[k]] - theirs.cpu[begin[k]])

        def at(table: Stamped, positions: NDArray[np.intp]) -> float:
            return float(table.wall[positions[k]]) - due

        return LateCycle(
            k + 1,
            due,
            late,
            reason,
            share,
            rests=at(ours, self._rests),
            awake=at(ours, self._awake),
            sent=at(ours, self._sent),
            taken=at(theirs, self._taken),
            moved=at(theirs, self._moved),
            answered=at(theirs, self._answered),
            heard=at(ours, self._heard),
            ran=(ran(self._taken, self._moved), ran(self._moved, self._answered)),
        )

    def _woken(self) -> NDArray[np.intp]:
        """When the server last began to do something before it listened for the SYNC and after it had nothing to do.

        Frames that arrive together are taken one by one without waiting; the turns of all of them are looked at.
        """
        server = self._server
        awake = server.where(Moment.ROUSED, Moment.SYNC_TAKEN)
        slept = server.wall[awake] - server.wall[np.maximum(awake - 1, 0)]
        return _last(awake[slept > _ASLEEP], self._listened, default=int(awake[0]))

    def _slept_on(self) -> Floats:
        """How long the server slept on (n,) [s] although the SYNC, or the command before it, was there."""
        theirs, sent = self._server.wall, self._master.wall[self._sent]
        last = np.maximum(theirs[self._taken] - np.maximum(sent, theirs[self._listened]), 0.0)
        woken = self._woken()
        before = np.where(theirs[woken] > sent, theirs[woken] - np.maximum(sent, theirs[np.maximum(woken - 1, 0)]), 0.0)
        return np.asarray(last + before)

    def _charge(self, charges: dict[Reason, Floats], party: _Party, work: _Work, delay: Floats | None = None) -> None:
        """Charge a party's work, or what of it made the cycle wait, to what held it up."""
        excess = _excess(work.wall if delay is None else np.minimum(delay, work.wall))
        away = work.wall - work.cpu >= excess / 2
        collecting = ~away & (work.collecting >= excess / 2)
        fetching = ~(away | collecting) & (_excess(work.faults) * _FAULT >= excess)
        for reason, mine in zip(
            (party.not_running, party.collecting, party.fetching, party.computing),
            (away, collecting, fetching, ~(away | collecting | fetching)),
            strict=True,
        ):
            charges[reason] = charges[reason] + np.where(mine, excess, 0.0)

    def _work(self, table: Stamped, begin: NDArray[np.intp], end: NDArray[np.intp]) -> _Work:
        total = _collected(table)
        wall, cpu, collecting, faults = (
            column[end] - column[begin] for column in (table.wall, table.cpu, total, table.faults)
        )
        return _Work(wall, cpu, collecting, faults)


def _excess(values: Floats) -> Floats:
    """Beyond the usual."""
    return np.maximum(values - np.median(values), 0.0)


def _collected(table: Stamped) -> Floats:
    """Time in collections of garbage up to each stamp (n,) [s]."""
    spent = np.zeros(len(table.wall))
    ends = table.where(Moment.COLLECTED)
    begins = _last(table.where(Moment.COLLECTS), ends, default=-1)
    whole = begins >= 0
    spent[ends[whole]] = table.wall[ends[whole]] - table.wall[begins[whole]]
    return np.cumsum(spent)


def _next(positions: NDArray[np.intp], after: NDArray[np.intp]) -> NDArray[np.intp]:
    """Of each position `after`, the first of some that follows it; the last one where none does."""
    if not len(positions):
        raise RecordError("A moment is missing in the stamps.", "Take those of a whole run.")
    return positions[np.minimum(np.searchsorted(positions, after, side="right"), len(positions) - 1)]


def _last(positions: NDArray[np.intp], before: NDArray[np.intp], default: int | None = None) -> NDArray[np.intp]:
    """Of each position `before`, the last of some that precedes it; `default` where none does."""
    if not len(positions):
        if default is None:
            raise RecordError("A moment is missing in the stamps.", "Take those of a whole run.")
        return np.full(len(before), default)
    found = np.searchsorted(positions, before) - 1
    return np.where(found >= 0, positions[np.maximum(found, 0)], positions[0] if default is None else default)

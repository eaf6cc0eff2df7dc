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
    """What a thread did between two instants, cycle by cycle (n,).

    Attributes:
        busy: time for which it was not waiting for anything [s].
        ran: time for which it had a processor [s].
        collecting: time for which it collected garbage [s].
        faults: pages that it waited for.
    """

    busy: Floats
    ran: Floats
    collecting: Floats
    faults: Floats


class _Doings:
    """What a thread has done up to any instant; between two stamps evenly.

    Args:
        table: its stamps.
        waits: where it begins and ends to wait.
    """

    def __init__(self, table: Stamped, waits: tuple[Moment, tuple[Moment, ...]]) -> None:
        begin, ends = waits
        # What is due is stamped with an instant that is not the one of the stamp.
        here = table.moment != Moment.DUE
        table = Stamped(table.moment[here], table.wall[here], table.cpu[here], table.faults[here])
        self._wall = table.wall
        waited = _summed(table, (begin,), ends)
        collecting = _summed(table, (Moment.COLLECTS,), (Moment.COLLECTED,))
        self._totals = (waited, table.cpu, collecting, table.faults)

    def between(self, begin: Floats, end: Floats) -> _Work:
        """From instants to instants (n,) [s]; nothing where they are in the other order."""
        end = np.maximum(begin, end)
        waited, ran, collecting, faults = (
            np.interp(end, self._wall, total) - np.interp(begin, self._wall, total) for total in self._totals
        )
        return _Work(np.maximum(end - begin - waited, 0.0), ran, collecting, faults)


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
        self._server = server
        heard = master.where(Moment.HEARD)
        if len(heard) < 2:
            raise RecordError("The master's stamps hold no two cycles.", "Let it drive for longer.")
        before, heard = heard[:-1], heard[1:]
        # A master that left cycles out has waited twice: what counts is the instant that it missed.
        self.due, self.rests = (master.wall[_next(master.where(one), before)] for one in (Moment.DUE, Moment.RESTS))
        self.awake, self.sent = (
            master.wall[_last(master.where(one), heard)] for one in (Moment.AWAKE, Moment.SYNC_SENT)
        )
        self.before, self.heard = master.wall[before], master.wall[heard]
        syncs = server.where(Moment.SYNC_TAKEN)
        # On another processor the SYNC may be taken before the master has returned from sending it.
        answers = np.searchsorted(server.wall[syncs], self.heard) - 1
        if len(syncs) == 0 or (answers < 0).any() or (server.wall[syncs[answers]] < self.rests).any():
            raise RecordError(
                "The server's stamps are not of the cycles of the master's.", "Take those of one run on one computer."
            )
        self._taken = syncs[answers]
        self._moved = _next(server.where(Moment.MOVED), self._taken)
        self._answered = _next(server.where(Moment.LISTENS), self._moved)
        self.taken, self.moved, self.answered = (server.wall[one] for one in (self._taken, self._moved, self._answered))
        self._masters = _Doings(master, (Moment.RESTS, (Moment.AWAKE,)))
        self._servers = _Doings(server, (Moment.LISTENS, (Moment.ROUSED, Moment.SYNC_TAKEN)))

    def charges(self) -> dict[Reason, Floats]:
        """What each reason has to answer for, cycle by cycle (n,) [s]."""
        charges = {reason: np.zeros(len(self.due)) for reason in Reason}
        charges[Reason.CYCLE_BEFORE] = np.maximum(self.before - self.due, 0.0)
        charges[Reason.MASTER_WOKE_LATE] = _excess(self.awake - np.maximum(self.due, self.rests))
        charges[Reason.MASTER_HEARD_LATE] = _excess(self.heard - np.maximum(self.answered, self.sent))
        before_sync = self._servers.between(self.sent, self.taken)
        slept = np.maximum(self.taken - self.sent, 0.0) - before_sync.busy
        charges[Reason.SERVER_WOKE_LATE] = _excess(slept)
        for party, work in (
            (_MASTER, self._masters.between(np.maximum(self.before, self.due), self.rests)),
            (_MASTER, self._masters.between(self.awake, self.sent)),
            (_SERVER, before_sync),
            (_PHYSICS, self._servers.between(self.taken, self.moved)),
            (_SERVER, self._servers.between(self.moved, self.answered)),
        ):
            _charge(charges, party, work)
        return charges

    def one(self, k: int, late: float, reason: Reason, share: float) -> LateCycle:
        """A cycle that is late."""
        due, cpu = float(self.due[k]), self._server.cpu
        taken, moved, answered = int(self._taken[k]), int(self._moved[k]), int(self._answered[k])
        return LateCycle(
            k + 1,
            due,
            late,
            reason,
            share,
            rests=float(self.rests[k]) - due,
            awake=float(self.awake[k]) - due,
            sent=float(self.sent[k]) - due,
            taken=float(self.taken[k]) - due,
            moved=float(self.moved[k]) - due,
            answered=float(self.answered[k]) - due,
            heard=float(self.heard[k]) - due,
            ran=(float(cpu[moved] - cpu[taken]), float(cpu[answered] - cpu[moved])),
        )


def _charge(charges: dict[Reason, Floats], party: _Party, work: _Work) -> None:
    """Charge what a party's work took beyond the usual to what held it up."""
    excess = _excess(work.busy)
    away = work.busy - work.ran >= excess / 2
    collecting = ~away & (work.collecting >= excess / 2)
    fetching = ~(away | collecting) & (_excess(work.faults) * _FAULT >= excess)
    for reason, mine in (
        (party.not_running, away),
        (party.collecting, collecting),
        (party.fetching, fetching),
        (party.computing, ~(away | collecting | fetching)),
    ):
        charges[reason] = charges[reason] + np.where(mine, excess, 0.0)


def _excess(values: Floats) -> Floats:
    """Beyond the usual."""
    return np.maximum(values - np.median(values), 0.0)


def _summed(table: Stamped, begins: tuple[Moment, ...], ends: tuple[Moment, ...]) -> Floats:
    """Time spent between moments and those that end them, up to each stamp (n,) [s]."""
    spent = np.zeros(len(table.wall))
    end = table.where(*ends)
    begin = _last(table.where(*begins), end, default=-1)
    whole = begin >= 0
    spent[end[whole]] = table.wall[end[whole]] - table.wall[begin[whole]]
    return np.cumsum(spent)


def _next(positions: NDArray[np.intp], after: NDArray[np.intp]) -> NDArray[np.intp]:
    """Of each position `after`, the first of some that follows it; the last one where none does."""
    if not len(positions):
        raise RecordError("A moment is missing in the stamps.", "Take those of a whole run.")
    return positions[np.minimum(np.searchsorted(positions, after, side="right"), len(positions) - 1)]


def _last(positions: NDArray[np.intp], before: NDArray[np.intp], default: int | None = None) -> NDArray[np.intp]:
    """Of each position `before`, the last of some that precedes it; `default`, or the first, where none does."""
    if not len(positions):
        if default is None:
            raise RecordError("A moment is missing in the stamps.", "Take those of a whole run.")
        return np.full(len(before), default)
    found = np.searchsorted(positions, before) - 1
    return np.where(found >= 0, positions[np.maximum(found, 0)], positions[0] if default is None else default)

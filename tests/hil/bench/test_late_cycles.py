"""Why a cycle is late, told from stamps that are made up so that one knows."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from hil.bench.explaining import explain
from hil.bench.lateness import LATE, MEANINGS, Reason, write_late_cycles
from hil.bus.stamps import Moment, Stamped, Stamps, read_stamps, write_stamps
from ident.errors import RecordError

CYCLES = 60
PERIOD = 0.002
NUMBER = 30
"""Of the cycle that is disturbed."""


@dataclass(frozen=True)
class Disturbance:
    """What one cycle suffers: `lasting` [s] behind a moment, of which the thread runs `ran` and collects `garbage`."""

    behind: Moment
    lasting: float = 0.003
    ran: float = 0.0
    garbage: float = 0.0
    faults: int = 0


class Thread:
    """Leaves stamps while a made-up time passes."""

    def __init__(self) -> None:
        self.wall = self.cpu = 0.0
        self.faults = 0
        self.stamps = Stamps(1 << 12, lambda: self.wall, lambda: self.cpu, lambda: self.faults)

    def at(self, moment: Moment, instant: float, runs: bool = True) -> None:
        """Be there then, or at once where it is later already."""
        passed = max(instant - self.wall, 0.0)
        self.wall += passed
        self.cpu += passed * runs
        self.stamps.stamp(moment)

    def suffer(self, disturbance: Disturbance) -> None:
        """Be held up."""
        if disturbance.garbage:
            self.stamps.stamp(Moment.COLLECTS)
        self.wall += disturbance.lasting
        self.cpu += disturbance.ran
        self.faults += disturbance.faults
        if disturbance.garbage:
            self.stamps.stamp(Moment.COLLECTED)


def played(disturbance: Disturbance | None) -> tuple[Stamped, Stamped]:
    """Master and server over some cycles, one of them disturbed."""
    master, server = Thread(), Thread()

    def hold_up(thread: Thread, behind: Moment, number: int) -> None:
        if disturbance is not None and number == NUMBER and disturbance.behind is behind:
            thread.suffer(disturbance)

    master.stamps.stamp(Moment.HEARD)
    server.stamps.stamp(Moment.LISTENS)
    for number in range(CYCLES):
        due = PERIOD * (number + 1)
        hold_up(master, Moment.HEARD, number)
        master.at(Moment.RESTS, due - 0.0012)
        master.stamps.stamp_due(due)
        hold_up(master, Moment.RESTS, number)
        master.at(Moment.AWAKE, due, runs=False)
        hold_up(master, Moment.AWAKE, number)
        master.at(Moment.SYNC_SENT, master.wall + 4e-5)
        # A command before it, and its work, is over long before; then the server waits.
        server.at(Moment.ROUSED, due - 0.0011, runs=False)
        hold_up(server, Moment.ROUSED, number)
        server.at(Moment.LISTENS, due - 0.0010)
        hold_up(server, Moment.LISTENS, number)
        server.at(Moment.SYNC_TAKEN, master.wall + 5e-5, runs=False)
        hold_up(server, Moment.SYNC_TAKEN, number)
        server.at(Moment.MOVED, server.wall + 2e-4)
        hold_up(server, Moment.MOVED, number)
        server.at(Moment.LISTENS, server.wall + 1e-4)
        hold_up(master, Moment.SYNC_SENT, number)
        master.at(Moment.HEARD, max(server.wall, master.wall) + 1e-4, runs=False)
    return master.stamps.table(), server.stamps.table()


DISTURBANCES = {
    Reason.MASTER_WOKE_LATE: Disturbance(Moment.RESTS, 0.0042),
    Reason.MASTER_NOT_RUNNING: Disturbance(Moment.AWAKE),
    Reason.MASTER_COMPUTING: Disturbance(Moment.AWAKE, ran=0.0029),
    Reason.MASTER_COLLECTING: Disturbance(Moment.AWAKE, ran=0.003, garbage=0.003),
    Reason.MASTER_FETCHING: Disturbance(Moment.AWAKE, ran=0.003, faults=40),
    Reason.MASTER_HEARD_LATE: Disturbance(Moment.SYNC_SENT),
    Reason.SERVER_WOKE_LATE: Disturbance(Moment.LISTENS, 0.0042),
    Reason.SERVER_NOT_RUNNING: Disturbance(Moment.SYNC_TAKEN),
    Reason.SERVER_COMPUTING: Disturbance(Moment.MOVED, ran=0.003),
    Reason.SERVER_COLLECTING: Disturbance(Moment.MOVED, ran=0.003, garbage=0.003),
    Reason.SERVER_FETCHING: Disturbance(Moment.SYNC_TAKEN, ran=0.003, faults=40),
    Reason.PHYSICS: Disturbance(Moment.SYNC_TAKEN, ran=0.003),
}


@pytest.mark.parametrize("reason", DISTURBANCES)
def test_who_held_a_cycle_up_is_named(reason: Reason) -> None:
    found = explain(*played(DISTURBANCES[reason]))
    first, *others = found.cycles
    assert first.number == NUMBER + 1
    assert first.reason is reason
    assert first.late == pytest.approx(first.share, abs=3e-4)
    assert {one.reason for one in others} <= {Reason.CYCLE_BEFORE}


def test_a_server_that_works_at_something_else_when_the_sync_comes_is_told_from_one_that_sleeps() -> None:
    for ran, reason in ((0.0, Reason.SERVER_NOT_RUNNING), (0.004, Reason.SERVER_COMPUTING)):
        found = explain(*played(Disturbance(Moment.ROUSED, 0.004, ran)))
        assert found.cycles[0].reason is reason


def test_a_master_that_comes_late_from_other_work_is_told_from_one_that_sleeps() -> None:
    for ran, reason in ((0.0, Reason.MASTER_NOT_RUNNING), (0.004, Reason.MASTER_COMPUTING)):
        found = explain(*played(Disturbance(Moment.HEARD, 0.004, ran)))
        assert found.cycles[0].reason is reason


def test_a_cycle_that_begins_late_because_the_one_before_was_is_said_to_be_so() -> None:
    found = explain(*played(Disturbance(Moment.SYNC_TAKEN, 0.005)))
    assert [one.reason for one in found.cycles[1:]] == [Reason.CYCLE_BEFORE] * (len(found.cycles) - 1)
    assert len(found.cycles) > 1


def test_an_undisturbed_run_has_no_late_cycle() -> None:
    found = explain(*played(None))
    assert found.cycles == ()
    assert np.abs(found.late).max() < 1e-9
    assert len(found.late) == CYCLES


def test_stamps_of_another_run_are_refused() -> None:
    master, server = played(None)
    elsewhere = Stamped(server.moment, server.wall - 5.0, server.cpu, server.faults)
    with pytest.raises(RecordError, match="not of the cycles"):
        explain(master, elsewhere)
    with pytest.raises(RecordError, match="no two cycles"):
        explain(server, server)


def test_every_reason_has_a_meaning() -> None:
    assert set(MEANINGS) == set(Reason)


def test_stamps_come_back_from_their_file(tmp_path: Path) -> None:
    master, _ = played(DISTURBANCES[Reason.MASTER_FETCHING])
    write_stamps(master, tmp_path / "stamps.csv")
    back = read_stamps(tmp_path / "stamps.csv")
    assert (back.moment == master.moment).all()
    assert np.allclose(back.wall, master.wall, atol=1e-7)
    assert np.allclose(back.cpu, master.cpu, atol=1e-7)
    assert (back.faults == master.faults).all()


def test_what_holds_no_stamps_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "other.csv"
    for text in ("", "time,value\n1,2\n", "moment,monotonic_s,thread_time_s,page_faults\nnever,1,2,3\n"):
        path.write_text(text)
        with pytest.raises(RecordError, match="holds no stamps"):
            read_stamps(path)


def test_only_the_newest_stamps_are_kept() -> None:
    thread = Thread()
    stamps = Stamps(4, lambda: thread.wall, lambda: 0.0, lambda: 0)
    for number in range(7):
        thread.wall = float(number)
        stamps.stamp(Moment.HEARD)
    assert stamps.table().wall.tolist() == [3.0, 4.0, 5.0, 6.0]


def test_late_cycles_are_written_instant_by_instant(tmp_path: Path) -> None:
    found = explain(*played(DISTURBANCES[Reason.PHYSICS]))
    write_late_cycles(found.cycles, tmp_path / "late.csv")
    with (tmp_path / "late.csv").open() as file:
        first = next(csv.DictReader(file))
    assert first["reason"] == "physics computing"
    assert float(first["late_ms"]) > 1e3 * LATE
    assert float(first["moved_ms"]) - float(first["taken_ms"]) == pytest.approx(3.2, abs=0.01)
    assert float(first["server_moving_ran_ms"]) == pytest.approx(3.2, abs=0.01)


def test_where_a_server_has_slept_and_then_worked_both_are_counted_and_the_longer_is_the_reason() -> None:
    """Frames that have queued up meanwhile are taken one by one before the SYNC: none of them alone is long."""
    master, server = played(Disturbance(Moment.LISTENS, 0.0042))
    sync = int(server.where(Moment.SYNC_TAKEN)[NUMBER])
    slept_until = float(server.wall[sync])
    begin = float(server.wall[sync - 1])
    for share, reason in ((0.3, Reason.SERVER_COMPUTING), (0.8, Reason.SERVER_WOKE_LATE)):
        turns = np.linspace(begin + share * (slept_until - begin), slept_until - 1e-5, 9)
        moments = [Moment.ROUSED if k % 2 == 0 else Moment.LISTENS for k in range(len(turns))]
        moments[-1] = Moment.LISTENS
        ran = np.cumsum([0.0, *(np.diff(turns) * (np.arange(len(turns) - 1) % 2 == 0))]) * (share < 0.5)
        more = float(ran[-1])
        dense = Stamped(
            np.concatenate([server.moment[:sync], moments, server.moment[sync:]]).astype(np.int8),
            np.concatenate([server.wall[:sync], turns, server.wall[sync:]]),
            np.concatenate([server.cpu[:sync], server.cpu[sync - 1] + ran, server.cpu[sync:] + more]),
            np.concatenate([server.faults[:sync], np.full(len(turns), server.faults[sync]), server.faults[sync:]]),
        )
        assert explain(master, dense).cycles[0].reason is reason

"""The same results from this process, from several, and from a cluster."""

from __future__ import annotations

import math

import pytest

from hil.exam.workers import run_all
from ident.errors import UserError

TASKS = [(number, 2) for number in range(100)]
POWERS = sorted(float(number**2) for number in range(100))


@pytest.mark.parametrize("jobs", [1, 2])
def test_processes_of_this_machine_do_all_tasks(jobs: int) -> None:
    assert sorted(run_all(math.pow, iter(TASKS), jobs=jobs, scheduler=None)) == POWERS


def test_tasks_are_taken_as_they_are_needed() -> None:
    taken = []

    def tasks() -> object:
        for task in TASKS:
            taken.append(task)
            yield task

    first = next(iter(run_all(math.pow, tasks(), jobs=1, scheduler=None)))
    assert (first, len(taken)) == (0.0, 1)


def test_a_scheduler_that_is_not_there_is_named() -> None:
    pytest.importorskip("distributed")
    with pytest.raises(UserError, match="No Dask scheduler answers"):
        list(run_all(math.pow, TASKS, jobs=1, scheduler="tcp://127.0.0.1:1"))


@pytest.mark.slow
def test_a_cluster_does_more_tasks_than_it_holds_at_a_time() -> None:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster:
        found = run_all(math.pow, iter(TASKS), jobs=1, scheduler=cluster.scheduler_address)
        assert sorted(found) == POWERS

"""Many cases at once: processes of this machine through joblib, or a Dask cluster by the name of its scheduler."""

from __future__ import annotations

import importlib
import itertools
from collections.abc import Callable, Iterable, Iterator
from typing import Any, Final, TypeVar

import joblib

from ident.errors import UserError

Result = TypeVar("Result")

WINDOW: Final = 64
"""Tasks that a cluster has at a time: each holds some megabytes."""


def run_all(
    function: Callable[..., Result], tasks: Iterable[tuple[Any, ...]], *, jobs: int, scheduler: str | None
) -> Iterator[Result]:
    """Results of `function(*task)` as they come.

    Nothing is shared but arguments and results, so a cluster needs no common disk.

    Args:
        function: of a module, so that another process finds it.
        tasks: its arguments, taken as they are needed.
        jobs: processes on this machine.
        scheduler: address of a Dask scheduler, None for this machine.

    Raises:
        UserError: Dask is not installed, or the scheduler does not answer.
    """
    if scheduler is not None:
        yield from _on_cluster(function, tasks, scheduler)
    elif jobs == 1:
        yield from (function(*task) for task in tasks)
    else:
        parallel = joblib.Parallel(n_jobs=jobs, return_as="generator_unordered", batch_size=1)
        yield from parallel(joblib.delayed(function)(*task) for task in tasks)


def _on_cluster(function: Callable[..., Result], tasks: Iterable[tuple[Any, ...]], scheduler: str) -> Iterator[Result]:
    try:
        distributed = importlib.import_module("distributed")
    except ImportError as error:
        raise UserError("A cluster needs Dask.", "Install it: pip install 'quasiomni[cluster]'.") from error
    try:
        client = distributed.Client(scheduler, timeout="10s")
    except (OSError, ValueError) as error:
        raise UserError(
            f"No Dask scheduler answers at {scheduler}: {error}.",
            "Start one: dask scheduler, then dask worker ADDRESS.",
        ) from error
    with client:
        waiting = iter(tasks)
        running = distributed.as_completed(
            client.submit(function, *task, pure=False) for task in itertools.islice(waiting, WINDOW)
        )
        for future in running:
            for task in itertools.islice(waiting, 1):
                running.add(client.submit(function, *task, pure=False))
            yield future.result()

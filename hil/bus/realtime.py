"""Keeps Python's garbage collector out of the cycle."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def steady_memory() -> Iterator[None]:
    """Set aside all objects there are, so that collections inside only look at new ones.

    A full collection of a process that has loaded numpy, scipy and CasADi takes more than 0.1 s, fifty cycles; it
    was seen to lose TPDOs.
    """
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()

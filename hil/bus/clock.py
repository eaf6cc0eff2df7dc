"""Clocks: one meaning of time for masters in lockstep with a simulation and on a real bus."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Protocol


class Clock(Protocol):
    """What a master needs of time."""

    def now(self) -> float:
        """Time [s]; on a real bus seconds since the Unix epoch, in simulation since its start."""

    def wait_until(self, instant: float) -> float:
        """Return when `instant` [s] has come, at once when it has passed; gives the lateness [s], at least 0."""


class SimulatedClock:
    """Time that passes only while somebody waits.

    Args:
        on_advance: called with the new instant [s] before it becomes `now`; the owner of the simulation moves
            the simulated world up to it there.
        start: first instant [s].
    """

    def __init__(self, on_advance: Callable[[float], None] | None = None, start: float = 0.0) -> None:
        self._on_advance = on_advance
        self._now = start

    def now(self) -> float:
        """Simulated time [s]."""
        return self._now

    def wait_until(self, instant: float) -> float:
        """Move simulated time to `instant` [s] unless it has passed; gives the lateness [s]."""
        if instant > self._now:
            if self._on_advance is not None:
                self._on_advance(instant)
            self._now = instant
        return self._now - instant


class WallClock:
    """Unix time, paced by the monotonic clock so that it never jumps; counts the instants that were missed.

    Args:
        tolerance: lateness [s] beyond which an awaited instant counts as an overrun.
        monotonic, unix, sleep: the operating system's clock functions.
    """

    SPIN = 0.0002
    """Last part of a wait [s] that is polled, because sleeping wakes up late by about this much."""

    def __init__(
        self,
        tolerance: float = 0.001,
        monotonic: Callable[[], float] = time.monotonic,
        unix: Callable[[], float] = time.time,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._monotonic = monotonic
        self._sleep = sleep
        self._origin = unix() - monotonic()
        self._tolerance = tolerance
        self.waits = 0
        self.overruns = 0
        self.worst_lateness = 0.0

    def now(self) -> float:
        """Seconds since the Unix epoch."""
        return self._origin + self._monotonic()

    def wait_until(self, instant: float) -> float:
        """Sleep, then poll, until `instant` [s]; lateness beyond the tolerance is counted in `overruns`."""
        remaining = instant - self.now()
        if remaining > self.SPIN:
            self._sleep(remaining - self.SPIN)
        while self.now() < instant:
            pass
        lateness = self.now() - instant
        self.waits += 1
        self.overruns += lateness > self._tolerance
        self.worst_lateness = max(self.worst_lateness, lateness)
        return lateness


class FreeRunningClock(WallClock):
    """Wall time that waits for nothing: for a master whose SYNC drives the time of the other side."""

    def wait_until(self, instant: float) -> float:
        """Return at once and never late: the SYNC that follows moves the other side's time."""
        return 0.0

"""Deterministic timers in simulated time, one set for all nodes of a network."""

from __future__ import annotations

import heapq
from collections.abc import Callable
from dataclasses import dataclass, field

_CANCELLED_AT_MOST = 256
"""Cancelled timers that may wait in the heap until it is tidied up."""


@dataclass(order=True)
class Timer:
    """A call due at `due` [s]; equal instants run in the order in which they were set."""

    due: float
    serial: int
    callback: Callable[[], None] = field(compare=False)
    cancelled: bool = field(default=False, compare=False)
    on_cancel: Callable[[], None] | None = field(default=None, compare=False)

    def cancel(self) -> None:
        """Make it never run."""
        if not self.cancelled:
            self.cancelled = True
            if self.on_cancel is not None:
                self.on_cancel()


class Timers:
    """A heap of timers; `now` [s] is the instant of the timer that runs, else of the last `run_until`."""

    def __init__(self, start: float = 0.0) -> None:
        self.now = start
        self._heap: list[Timer] = []
        self._serial = 0
        self._cancelled = 0

    def after(self, delay: float, callback: Callable[[], None]) -> Timer:
        """Run `callback` in `delay` seconds."""
        self._serial += 1
        timer = Timer(round(self.now + delay, 9), self._serial, callback, on_cancel=self._count_cancelled)
        heapq.heappush(self._heap, timer)
        return timer

    def next_event(self) -> float:
        """Instant of the next timer [s], infinite when there is none."""
        while self._heap and self._heap[0].cancelled:
            heapq.heappop(self._heap)
            self._cancelled -= 1
        return self._heap[0].due if self._heap else float("inf")

    def run_until(self, instant: float, move: Callable[[float], None]) -> None:
        """Run what is due up to `instant` [s], with `move(due)` before each timer and at the end."""
        while (due := self.next_event()) <= instant:
            timer = heapq.heappop(self._heap)
            # A timer that has run is no longer in the heap: cancelling it later must not be counted.
            timer.on_cancel = None
            self.now = max(self.now, due)
            move(self.now)
            timer.callback()
        self.now = max(self.now, instant)
        move(self.now)

    def _count_cancelled(self) -> None:
        self._cancelled += 1
        # A peer that keeps changing a long period would otherwise fill the memory with timers that never run.
        if self._cancelled > max(_CANCELLED_AT_MOST, len(self._heap) // 2):
            self._heap = [timer for timer in self._heap if not timer.cancelled]
            heapq.heapify(self._heap)
            self._cancelled = 0

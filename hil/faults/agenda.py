"""What is to happen at instants of simulated time, in the order of the instants and then of the entries."""

from __future__ import annotations

import heapq
from collections.abc import Callable
from itertools import count


class Agenda:
    """A heap of calls; whoever moves time runs them."""

    def __init__(self) -> None:
        self._heap: list[tuple[float, int, Callable[[], object]]] = []
        self._serial = count()

    def at(self, instant: float, call: Callable[[], object]) -> None:
        """Call at `instant` [s]; an infinite one never comes."""
        if instant != float("inf"):
            heapq.heappush(self._heap, (round(instant, 9), next(self._serial), call))

    def next_event(self) -> float:
        """Instant of the next call [s], infinite if there is none."""
        return self._heap[0][0] if self._heap else float("inf")

    def run(self, instant: float) -> None:
        """Make the calls that are due at `instant` [s]."""
        while self._heap and self._heap[0][0] <= instant:
            heapq.heappop(self._heap)[2]()

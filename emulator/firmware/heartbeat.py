"""Heartbeat producer (1017h) and consumer (1016h) of CiA 301, 7.2.8.3.2."""

from __future__ import annotations

from collections.abc import Callable

from emulator.firmware.dictionary import AbortCode, AbortError, Dictionary
from emulator.firmware.timers import Timer, Timers

_CONSUMERS = 4


class HeartbeatProducer:
    """Sends the NMT state every 1017h milliseconds, for the first time at once."""

    def __init__(self, dictionary: Dictionary, timers: Timers, send: Callable[[], None]) -> None:
        self._dictionary = dictionary
        self._timers = timers
        self._send = send
        self._timer: Timer | None = None
        dictionary.on_write(0x1017, 0, self._start)

    def reset(self) -> None:
        """Start again with the value in the dictionary."""
        self._stop()
        period = self._dictionary.value(0x1017)
        if period:
            self._timer = self._timers.after(period / 1000.0, lambda: self._beat(period))

    def _start(self, period: int) -> None:
        self._stop()
        if period:
            self._beat(period)

    def _stop(self) -> None:
        if self._timer is not None:
            self._timer.cancel()

    def _beat(self, period: int) -> None:
        self._send()
        self._timer = self._timers.after(period / 1000.0, lambda: self._beat(period))


class HeartbeatConsumer:
    """Watches the nodes in 1016h; monitoring of a node starts with its first heartbeat."""

    def __init__(self, dictionary: Dictionary, timers: Timers, lost: Callable[[int], None]) -> None:
        self._dictionary = dictionary
        self._timers = timers
        self._lost = lost
        self._periods: dict[int, float] = {}
        self._deadlines: dict[int, float] = {}
        self._watch: dict[int, Timer] = {}
        for subindex in range(1, _CONSUMERS + 1):
            dictionary.on_write(0x1016, subindex, self._writer(subindex))

    def reset(self) -> None:
        """Take the nodes from the dictionary and wait for their first heartbeats."""
        self._configure([self._dictionary.value(0x1016, k) for k in range(1, _CONSUMERS + 1)])

    def receive(self, node_id: int) -> None:
        """A heartbeat of `node_id` has arrived."""
        period = self._periods.get(node_id)
        if period is None:
            return
        # Moving the deadline is cheaper than a new timer for every heartbeat; the timer looks when it is due.
        self._deadlines[node_id] = self._timers.now + period
        if node_id not in self._watch:
            self._watch[node_id] = self._timers.after(period, lambda: self._check(node_id))

    def _check(self, node_id: int) -> None:
        remaining = self._deadlines[node_id] - self._timers.now
        if remaining > 1e-9:
            self._watch[node_id] = self._timers.after(remaining, lambda: self._check(node_id))
            return
        del self._watch[node_id]
        self._lost(node_id)

    def _writer(self, subindex: int) -> Callable[[int], None]:
        def write(value: int) -> None:
            entries = [self._dictionary.value(0x1016, k) for k in range(1, _CONSUMERS + 1)]
            entries[subindex - 1] = value
            nodes = [entry >> 16 & 0x7F for entry in entries if entry & 0xFFFF and entry >> 16 & 0x7F]
            if len(nodes) != len(set(nodes)):
                raise AbortError(AbortCode.PARAMETER_INCOMPATIBLE)
            self._configure(entries)

        return write

    def _configure(self, entries: list[int]) -> None:
        for timer in self._watch.values():
            timer.cancel()
        self._watch.clear()
        self._periods = {
            entry >> 16 & 0x7F: (entry & 0xFFFF) / 1000.0 for entry in entries if entry & 0xFFFF and entry >> 16 & 0x7F
        }

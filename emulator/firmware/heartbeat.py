"""Heartbeat producer (1017h) and consumer (1016h) of CiA 301, 7.2.8.3.2."""

from __future__ import annotations

from collections.abc import Callable

from emulator.firmware.dictionary import AbortCode, AbortError, Dictionary
from emulator.firmware.nodebus import NodeBus
from emulator.firmware.timers import Timer, Timers

ERROR_CONTROL = 0x700
"""Identifier of the heartbeat of a node, less its node id."""

_HIGHEST_NODE_ID = 0x7F


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
        period = self._dictionary.value(0x1017, default=0)
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
    """Watches the nodes in 1016h; monitoring of a node starts with its first heartbeat.

    Args:
        dictionary: holds 1016h.
        timers: simulated time.
        bus: where heartbeats come from.
        lost: called with the node id when a heartbeat is missing.
        found: called when none is missing any more.
    """

    def __init__(
        self,
        dictionary: Dictionary,
        timers: Timers,
        bus: NodeBus,
        lost: Callable[[int], None],
        found: Callable[[], None],
    ) -> None:
        self._dictionary = dictionary
        self._timers = timers
        self._bus = bus
        self._lost = lost
        self._found = found
        self._entries = range(1, dictionary.value(0x1016, 0, default=0) + 1)
        self._periods: dict[int, float] = {}
        self._deadlines: dict[int, float] = {}
        self._watch: dict[int, Timer] = {}
        self._missing: set[int] = set()
        for subindex in self._entries:
            dictionary.on_write(0x1016, subindex, self._writer(subindex))

    def reset(self) -> None:
        """Take the nodes from the dictionary and wait for their first heartbeats."""
        self._missing.clear()
        self._configure([self._dictionary.value(0x1016, k) for k in self._entries])

    def receive(self, can_id: int, _data: bytes) -> None:
        """A heartbeat has arrived, or a boot-up, which is one too."""
        node_id = can_id - ERROR_CONTROL
        # Moving the deadline is cheaper than a new timer for every heartbeat; the timer looks when it is due.
        self._deadlines[node_id] = self._timers.now + self._periods[node_id]
        if node_id not in self._watch:
            self._watch[node_id] = self._timers.after(self._periods[node_id], lambda: self._check(node_id))
        if self._missing:
            self._forget(self._missing - {node_id})

    def _check(self, node_id: int) -> None:
        remaining = self._deadlines[node_id] - self._timers.now
        if remaining > 1e-9:
            self._watch[node_id] = self._timers.after(remaining, lambda: self._check(node_id))
            return
        del self._watch[node_id]
        self._missing.add(node_id)
        self._lost(node_id)

    def _writer(self, subindex: int) -> Callable[[int], None]:
        def write(value: int) -> None:
            if value >> 16 & 0xFF > _HIGHEST_NODE_ID:
                raise AbortError(AbortCode.PARAMETER_INCOMPATIBLE)
            entries = [self._dictionary.value(0x1016, k) for k in self._entries]
            entries[subindex - 1] = value
            nodes = [_node(entry) for entry in entries if _watches(entry)]
            if len(nodes) != len(set(nodes)):
                raise AbortError(AbortCode.PARAMETER_INCOMPATIBLE)
            self._configure(entries)

        return write

    def _configure(self, entries: list[int]) -> None:
        for timer in self._watch.values():
            timer.cancel()
        self._watch.clear()
        for node_id in self._periods:
            self._bus.unsubscribe(ERROR_CONTROL + node_id, self.receive)
        self._periods = {_node(entry): (entry & 0xFFFF) / 1000.0 for entry in entries if _watches(entry)}
        for node_id in self._periods:
            self._bus.subscribe(ERROR_CONTROL + node_id, self.receive)
        self._forget(self._missing & set(self._periods))

    def _forget(self, still_missing: set[int]) -> None:
        ended = bool(self._missing) and not still_missing
        self._missing = still_missing
        if ended:
            self._found()


def _node(entry: int) -> int:
    return entry >> 16 & _HIGHEST_NODE_ID


def _watches(entry: int) -> bool:
    """A node id and a time: without either the entry is not used."""
    return bool(entry & 0xFFFF and _node(entry))

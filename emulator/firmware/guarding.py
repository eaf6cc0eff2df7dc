"""Node guarding and life guarding: 100Ch, 100Dh (CiA 301, 7.2.8.3.1)."""

from __future__ import annotations

from collections.abc import Callable

from emulator.firmware.dictionary import Dictionary
from emulator.firmware.timers import Timer, Timers

_TOGGLE = 0x80


class NodeGuarding:
    """Answers the master's remote frames, and notices when they stop; a node with a heartbeat does neither.

    Args:
        dictionary: holds 100Ch, 100Dh and 1017h.
        timers: simulated time.
        answer: sends a byte under the identifier of the NMT error control.
        lost: called when no remote frame has come for the node life time.
        found: called when one has come again.
    """

    def __init__(
        self,
        dictionary: Dictionary,
        timers: Timers,
        answer: Callable[[int], None],
        lost: Callable[[], None],
        found: Callable[[], None],
    ) -> None:
        self._dictionary = dictionary
        self._timers = timers
        self._answer = answer
        self._lost = lost
        self._found = found
        self._toggle = 0
        self._watch: Timer | None = None
        self._missing = False
        for index in (0x100C, 0x100D):
            dictionary.on_write(index, 0, self._changed)

    def reset(self) -> None:
        """Not guarded until the first remote frame; the toggle bit starts with 0."""
        self._toggle = 0
        self._missing = False
        self._stop()

    def request(self, state: int) -> None:
        """A remote frame of the master has come in this NMT state."""
        if self._dictionary.value(0x1017, default=0):
            return
        self._answer(state | self._toggle)
        self._toggle ^= _TOGGLE
        if self._missing:
            self._missing = False
            self._found()
        self._stop()
        guard_time, factor = (self._dictionary.value(index, default=0) for index in (0x100C, 0x100D))
        life_time = guard_time * factor / 1000.0
        if life_time:
            self._watch = self._timers.after(life_time, self._expire)

    def _expire(self) -> None:
        self._watch = None
        if not self._dictionary.value(0x1017, default=0):
            self._missing = True
            self._lost()

    def _changed(self, _value: int) -> None:
        self._stop()

    def _stop(self) -> None:
        if self._watch is not None:
            self._watch.cancel()
            self._watch = None

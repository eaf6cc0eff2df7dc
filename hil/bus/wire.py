"""The wire of a classic CAN bus: one frame at a time, the lowest identifier first, and how busy that makes it."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Final

from hil.bus.frame_kinds import ERROR_FRAME

WINDOW: Final = 0.1
"""Span over which the peak of the bus load is taken [s]."""

_EXTENDED_BITS: Final = 18
_PRIORITY_OF_ERRORS: Final = -1


def arbitration_key(can_id: int, extended: bool = False, remote: bool = False) -> int:
    """What wins arbitration, smallest first: the bits of the arbitration field in their order (ISO 11898-1).

    Args:
        can_id: identifier; with `ERROR_FRAME` in it, an error frame, which does not wait for arbitration.
        extended: 29-bit identifier.
        remote: remote frame.
    """
    if can_id & ERROR_FRAME:
        return _PRIORITY_OF_ERRORS
    if extended:
        base, rest = can_id >> _EXTENDED_BITS, can_id & (1 << _EXTENDED_BITS) - 1
        # After the base identifier come SRR and IDE, both recessive, the rest, and RTR.
        return (base << 2 | 0b11) << _EXTENDED_BITS + 1 | rest << 1 | remote
    return (can_id << 2 | remote << 1) << _EXTENDED_BITS + 1


class BusLoad:
    """How busy a wire was.

    Args:
        bit_rate: [bit/s].

    Attributes:
        frames: frames transmitted, error frames included.
        errors: error frames among them.
        peak: largest load in a window of 0.1 s [-].
        longest_wait: longest time from a request to the start of its frame [s].
    """

    def __init__(self, bit_rate: float) -> None:
        self._bit_time = 1.0 / bit_rate
        self._bits = 0
        self._begin: float | None = None
        self._end = 0.0
        self._window_end = -math.inf
        self._window_bits = 0
        self.frames = 0
        self.errors = 0
        self.peak = 0.0
        self.longest_wait = 0.0

    @property
    def bits(self) -> int:
        """Bit times of all frames, their stuff bits counted."""
        return self._bits

    @property
    def mean(self) -> float:
        """Load from the first frame to the last [-]."""
        if self._begin is None:
            return 0.0
        return self._bits * self._bit_time / max(self._end - self._begin, self._bit_time)

    def count(self, requested: float, end: float, bits: int, is_error: bool) -> None:
        """A frame has been transmitted: requested at `requested` [s], last bit at `end` [s]."""
        if self._begin is None:
            self._begin = end - bits * self._bit_time
        self._end = end
        self._bits += bits
        self.frames += 1
        self.errors += is_error
        wait = end - bits * self._bit_time - requested
        if wait > self.longest_wait:
            self.longest_wait = wait
        if end > self._window_end:
            self._window_end, self._window_bits = end + WINDOW, 0
        self._window_bits += bits
        load = self._window_bits * self._bit_time / WINDOW
        if load > self.peak:
            self.peak = load


@dataclass(frozen=True)
class _Request:
    instant: float
    key: int
    bits: int
    deliver: Callable[[float], None]


class Wire:
    """A wire with frames on it, and frames that wait for it.

    Frames of one source keep their order, as in the transmit queue of a CAN interface; the first ones of all sources
    take part in the arbitration whenever the wire is free. What is *not* modelled: bit errors, retransmission,
    clock tolerance, more than one attempt of the same identifier by two sources.

    Args:
        bit_rate: [bit/s].

    Attributes:
        load: how busy it was.
    """

    def __init__(self, bit_rate: float) -> None:
        self.load = BusLoad(bit_rate)
        self._bit_time = 1.0 / bit_rate
        self._queues: dict[Hashable, deque[_Request]] = {}
        self._current: tuple[float, _Request] | None = None
        self._free = 0.0

    def occupy(self, now: float, bits: int, is_error: bool = False) -> float:
        """Put a frame behind those that have been sent, whatever its identifier; gives the end of its last bit [s]."""
        self._free = max(self._free, now) + bits * self._bit_time
        self.load.count(now, self._free, bits, is_error)
        return self._free

    def request(self, now: float, source: Hashable, key: int, bits: int, deliver: Callable[[float], None]) -> None:
        """Ask for the wire.

        Args:
            now: the instant [s].
            source: whose transmit queue the frame joins.
            key: see `arbitration_key`.
            bits: length of the frame [bit times].
            deliver: called with the instant of its last bit [s].
        """
        self._queues.setdefault(source, deque()).append(_Request(now, key, bits, deliver))

    def next_event(self) -> float:
        """When the frame on the wire ends [s]; infinite where none is on it and none waits."""
        # Looked for as late as this, so that all who ask at one instant take part in the arbitration.
        if self._current is None and self._queues:
            self._arbitrate()
        return math.inf if self._current is None else self._current[0]

    def run(self, instant: float) -> None:
        """Deliver the frames that have ended by `instant` [s]."""
        while self.next_event() <= instant and self._current is not None:
            (end, request), self._current = self._current, None
            self._free = end
            self.load.count(request.instant, end, request.bits, request.key == _PRIORITY_OF_ERRORS)
            request.deliver(end)

    def _arbitrate(self) -> None:
        heads = [(queue[0].key, source) for source, queue in self._queues.items()]
        start = max(self._free, min(queue[0].instant for queue in self._queues.values()))
        waiting = [(key, k) for k, (key, source) in enumerate(heads) if self._queues[source][0].instant <= start]
        source = heads[min(waiting)[1]][1]
        queue = self._queues[source]
        request = queue.popleft()
        if not queue:
            del self._queues[source]
        self._current = (start + request.bits * self._bit_time, request)


@dataclass(frozen=True)
class FrameTiming:
    """A periodic frame: identifier, longest length, period and jitter of its request.

    Attributes:
        can_id: 11-bit identifier.
        bits: longest length on the wire [bit times].
        period: shortest time between two requests [s].
        jitter: variation of the instant of the request [s].
    """

    can_id: int
    bits: int
    period: float
    jitter: float = 0.0


def longest_responses(frames: list[FrameTiming], bit_rate: float, limit: float = 1.0) -> dict[int, float]:
    """Longest time from the request of each frame to its last bit [s], all frames asked for at the worst instant.

    Davis, Burns, Bril, Lukkien: Controller Area Network (CAN) schedulability analysis: Refuted, revisited and
    revised, Real-Time Systems 35 (2007), equations 10 to 13, in the sufficient form whose blocking is the longest
    frame of lower or equal priority.

    Args:
        frames: all that is sent.
        bit_rate: [bit/s].
        limit: a frame that waits longer never passes: its time is infinite [s].
    """
    bit_time = 1.0 / bit_rate
    return {frame.can_id: frame.jitter + _response(frame, frames, bit_time, limit) for frame in frames}


def _response(frame: FrameTiming, frames: list[FrameTiming], bit_time: float, limit: float) -> float:
    own = frame.bits * bit_time
    higher = [other for other in frames if other.can_id < frame.can_id]
    blocking = max((other.bits for other in frames if other.can_id >= frame.can_id), default=0) * bit_time
    wait, previous = blocking, -1.0
    while wait != previous and wait <= limit:
        previous = wait
        busy = (math.ceil((wait + other.jitter + bit_time) / other.period) * other.bits for other in higher)
        wait = blocking + sum(busy) * bit_time
    return wait + own if wait <= limit else math.inf

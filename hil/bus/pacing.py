"""Senders that are faster than a wire, held to its speed; masters that wait for answers are not."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from hil.bus.listener import Listener

TURN: Final = 16
"""Most frames that are taken from one client before the others have had their turn."""

_FRAME_BITS: Final = 111
"""Of a frame with an 11-bit identifier and 8 bytes, without stuff bits [bit times]."""

_WINDOW: Final = 0.1
"""Time over which the speed of a sender is looked at [s]."""

_TRUST: Final = 1.0
"""Time for which a sender that has turned out to wait for answers is not tried again [s]."""


_PROOF: Final = 16
"""Most turns that a sender must be found to have no more to send before it is let go."""


@dataclass
class _Hold:
    """Since when a sender is held, as its turns say.

    Attributes:
        due: instant of its next turn [s].
        floods: more was waiting than a turn takes, at least once.
        evidence: turns with more waiting, less turns without; it falls below zero when the sender is let go.
    """

    due: float
    floods: bool = False
    evidence: int = 0


class Pacing:
    """Decides which senders have to wait between their turns, and until when.

    A master in lockstep may send more frames a second than a wire carries, and so does a flood: how many they send does
    not tell them apart. So whoever sends faster than the wire is made to wait once, for as long as the wire takes for
    the frames of a turn. A master that waits for answers has no more to send meanwhile, and is let go. Of a flood more
    is waiting than a turn takes: it goes on at the speed of the wire, which all such senders share, its own socket
    holds it back, and it is let go when it has had nothing to send for a while.

    Args:
        bit_rate: of the wire [bit/s].
        monotonic: time [s].
    """

    def __init__(self, bit_rate: float, monotonic: Callable[[], float]) -> None:
        self._rate = bit_rate / _FRAME_BITS
        self._monotonic = monotonic
        self._looked = monotonic()
        self._holds: dict[Listener, _Hold] = {}
        self._trusted: dict[Listener, float] = {}

    def holds(self, sender: Listener) -> bool:
        """Whether a sender is held to the speed of the wire."""
        return sender in self._holds

    def look(self, senders: Sequence[Listener]) -> list[Listener]:
        """Those among the senders that have to wait from now on; looks once in a while and is cheap between."""
        now = self._monotonic()
        elapsed = now - self._looked
        if elapsed < _WINDOW:
            return []
        self._looked = now
        fast = [sender for sender in senders if sender.taken > self._rate * elapsed and self._may_hold(sender, now)]
        for sender in senders:
            sender.taken = 0
        for sender in fast:
            self._holds[sender] = _Hold(0.0)
            self._holds[sender].due = now + self._turn_time()
        return fast

    def _may_hold(self, sender: Listener, now: float) -> bool:
        return sender not in self._holds and self._trusted.get(sender, now) <= now

    def _turn_time(self) -> float:
        """Time in which the wire carries a turn of each sender that is held [s]."""
        return TURN * len(self._holds) / self._rate

    def judge(self, sender: Listener, frames: int, more: bool) -> bool:
        """A sender that is held has had its turn; whether it is let go.

        Args:
            sender: the sender.
            frames: what it had to send.
            more: it may have had more.
        """
        now, hold = self._monotonic(), self._holds[sender]
        hold.floods = hold.floods or more
        hold.evidence = min(hold.evidence + 1, _PROOF) if more else hold.evidence - 1
        hold.due = now + self._turn_time()
        if hold.evidence >= 0:
            return False
        del self._holds[sender]
        if frames and not hold.floods:
            # It was in the middle of a conversation. One that had nothing to send may have ended a burst.
            self._trusted[sender] = now + _TRUST
        return True

    def forget(self, sender: Listener) -> None:
        """It is gone."""
        self._holds.pop(sender, None)
        self._trusted.pop(sender, None)

    def due(self) -> list[Listener]:
        """Those who are held and whose turn has come."""
        if not self._holds:
            return []
        now = self._monotonic()
        return [sender for sender, hold in self._holds.items() if hold.due <= now]

    def patience(self, timeout: float | None) -> float | None:
        """The time-out [s], shortened to the next turn of a sender that is held."""
        if not self._holds:
            return timeout
        left = max(min(hold.due for hold in self._holds.values()) - self._monotonic(), 0.0)
        return left if timeout is None else min(left, timeout)

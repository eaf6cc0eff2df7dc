"""Watches expectations while a scenario runs, and says what came of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from hil.pytest_plugin.world import Observed
from hil.scenario.scenario import Expected, Span
from ident.errors import DataFileError, UserError


@dataclass(frozen=True)
class Outcome:
    """What came of an expectation.

    Attributes:
        expected: what was expected.
        passed: whether it is so.
        time: when that was decided, from the beginning of the scenario [s]; None where its time did not come.
        found: what was the case then, in words.
    """

    expected: Expected
    passed: bool
    time: float | None
    found: str

    def __str__(self) -> str:
        when = "never" if self.time is None else f"at {self.time:.3f} s"
        return f"{'pass' if self.passed else 'FAIL'}: {self.expected}; {when}, {self.found}"


@dataclass
class _Open:
    """An expectation whose time has come."""

    number: int
    expected: Expected
    since: int
    seen: int


class Watch:
    """Expectations that are looked at whenever somebody asks for it.

    Args:
        world: what is watched.
        expected: what is expected.
        begin: instant from which its times count [s].
    """

    def __init__(self, world: Observed, expected: Sequence[Expected], begin: float) -> None:
        self._world = world
        self._begin = begin
        self._waiting = sorted(enumerate(expected), key=lambda entry: entry[1].at)
        self._open: list[_Open] = []
        self._outcomes: dict[int, Outcome] = {}

    @property
    def decided(self) -> bool:
        """Nothing is left to look at."""
        return not self._waiting and not self._open

    def look(self) -> None:
        """Look at everything whose time has come and is not over.

        Raises:
            UserError: an expectation is about something that is not there.
        """
        now = self._world.now - self._begin
        while self._waiting and self._waiting[0][1].at <= now + _ROUNDING:
            number, expected = self._waiting.pop(0)
            since = self._world.frames_until(self._begin + expected.at)
            self._open.append(_Open(number, expected, since, since))
        self._open = [one for one in self._open if not self._decide(one, now)]

    def outcomes(self) -> tuple[Outcome, ...]:
        """Of all expectations, in the order of the file; what was not decided has failed."""
        now = self._world.now - self._begin
        for one in self._open:
            self._note(one, False, now, f"not decided when the scenario ended: {self._found(one)}")
        for number, expected in self._waiting:
            self._outcomes[number] = Outcome(expected, False, None, "the scenario ended before")
        return tuple(self._outcomes[number] for number in sorted(self._outcomes))

    def _decide(self, one: _Open, now: float) -> bool:
        span, over = one.expected.span, now >= one.expected.end - _ROUNDING
        # Whoever looks late must not take what happened after the span for something within it.
        late = now > one.expected.end + _LATE and span is not Span.NOW
        holds = not late and self._holds(one)
        if span in (Span.NOW, Span.WITHIN):
            done, passed = holds or over, holds
        elif span is Span.THROUGHOUT:
            done, passed = over or not holds, holds or late
        else:
            done, passed = over or holds, not holds
        if done:
            self._note(one, passed, now, self._found(one))
        return done

    def _holds(self, one: _Open) -> bool:
        # Frames that did not fulfil it are not looked at again.
        seen, one.seen = one.seen, len(self._world.frames)
        try:
            return one.expected.condition.holds(self._world, seen)
        except UserError as error:
            raise DataFileError(f"expect[{one.number + 1}]: {error.what}", error.remedy) from error

    def _found(self, one: _Open) -> str:
        return one.expected.condition.found(self._world, one.since)

    def _note(self, one: _Open, passed: bool, time: float, found: str) -> None:
        self._outcomes[one.number] = Outcome(one.expected, passed, time, found)


_ROUNDING = 1e-9
_LATE = 0.01
"""Lateness of a look [s] that counts as in time: so often the bench is looked at within a step that takes long."""

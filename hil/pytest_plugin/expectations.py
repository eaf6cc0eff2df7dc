"""Sentences about simulated time: `expect(at_rest()).within(3.0)`."""

from __future__ import annotations

from typing import NoReturn

from hil.pytest_plugin.conditions import Condition
from hil.pytest_plugin.world import World


class Expectation:
    """A condition that waits for its time span.

    Frames count from the instant on in which it begins, those of this very instant included: what a fault does at
    once is not missed.

    Args:
        world: the bench.
        condition: what is expected.
    """

    def __init__(self, world: World, condition: Condition) -> None:
        self._world = world
        self._condition = condition
        self._begin = world.now
        self._since = self._seen = world.frames_until(self._begin)

    def within(self, duration: float) -> float:
        """The condition comes true within `duration` [s] of simulated time; gives how long it took [s].

        Raises:
            AssertionError: it does not.
        """
        reached = self._world.run_until(self._holds, duration)
        if reached is None:
            self._fail(f"{self._condition.text} within {duration:g} s")
        took = reached - self._begin
        self._world.note(reached, f"{self._condition.text}: after {took * 1e3:.0f} ms")
        return took

    def now(self) -> None:
        """The condition holds at this instant.

        Raises:
            AssertionError: it does not.
        """
        if not self._holds():
            self._fail(f"{self._condition.text} now")

    def throughout(self, duration: float) -> None:
        """The condition holds all the time for `duration` [s].

        Raises:
            AssertionError: it ceases to.
        """
        if self._world.run_until(lambda: not self._holds(), duration) is not None:
            self._fail(f"{self._condition.text} throughout {duration:g} s")

    def never_within(self, duration: float) -> None:
        """The condition does not come true for `duration` [s].

        Raises:
            AssertionError: it does.
        """
        if self._world.run_until(self._holds, duration) is not None:
            self._fail(f"never {self._condition.text} within {duration:g} s")

    def _holds(self) -> bool:
        # Frames that did not fulfil it are not looked at again.
        seen, self._seen = self._seen, len(self._world.frames)
        return self._condition.holds(self._world, seen)

    def _fail(self, sentence: str) -> NoReturn:
        world = self._world
        world.note(world.now, f"FAILED: {sentence}")
        passed = world.now - self._begin
        raise AssertionError(
            f"Expected {sentence}; at t = {world.now:.3f} s, {passed:.3f} s later, "
            f"{self._condition.found(world, self._since)}."
        )


class Expect:
    """Begins a sentence: `expect(condition)`.

    Args:
        world: the bench.
    """

    def __init__(self, world: World) -> None:
        self._world = world

    def __call__(self, condition: Condition) -> Expectation:
        """What follows is about this condition."""
        return Expectation(self._world, condition)

"""A scenario as data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from hil.faults import Fault
from hil.network import Role
from hil.pytest_plugin.conditions import Condition


class Begin(StrEnum):
    """What a scenario's times count from."""

    ENABLED = "enabled"
    """The first instant in which all drives are in operation enabled."""
    START = "start"
    """Its own start."""


class Span(StrEnum):
    """How an expectation is about time."""

    NOW = "now"
    WITHIN = "within"
    THROUGHOUT = "throughout"
    NEVER_WITHIN = "never_within"


@dataclass(frozen=True)
class Torques:
    """Motor torques from an instant on.

    Attributes:
        at: when the change begins [s].
        torques: fl, rl, fr, rr, vehicle signs [Nm].
        over: time of the ramp to them [s]; 0 for a step.
    """

    at: float
    torques: tuple[float, float, float, float]
    over: float = 0.0


@dataclass(frozen=True)
class Writing:
    """An object that the master writes by SDO.

    Attributes:
        at: when [s].
        role: whose.
        index, subindex: of the object.
        value: written.
    """

    at: float
    role: Role
    index: int
    subindex: int
    value: int

    def __str__(self) -> str:
        return f"{self.role} {self.index:04X}h:{self.subindex} = {self.value}"


@dataclass(frozen=True)
class Expected:
    """Something that is expected.

    Attributes:
        at: from when [s].
        condition: what.
        span: how it is about time.
        duration: of the span [s]; 0 for `NOW`.
    """

    at: float
    condition: Condition
    span: Span
    duration: float = 0.0

    @property
    def end(self) -> float:
        """When it is decided at the latest [s]."""
        return self.at + self.duration

    def __str__(self) -> str:
        words = {
            Span.NOW: f"{self.condition.text} at {self.at:g} s",
            Span.WITHIN: f"{self.condition.text} within {self.duration:g} s from {self.at:g} s on",
            Span.THROUGHOUT: f"{self.condition.text} throughout {self.duration:g} s from {self.at:g} s on",
            Span.NEVER_WITHIN: f"never {self.condition.text} within {self.duration:g} s from {self.at:g} s on",
        }
        return words[self.span]


@dataclass(frozen=True)
class Scenario:
    """What happens to a vehicle, and what is expected of it; times in s, from `begin` on.

    Attributes:
        path: of the file.
        name: for people.
        begin: what times count from.
        lifted: the vehicle stands on its jack-stand.
        duration: how long it lasts.
        torques: of the scenario's own master, in the order of time.
        writings: of that master.
        faults: their times counted from the beginning of the scenario.
        expected: in the order of the file.
        settings: what the bench is built of, as far as the file says: `prototype`, `network`, `seed`.
    """

    path: Path
    name: str
    begin: Begin
    lifted: bool
    duration: float
    torques: tuple[Torques, ...]
    writings: tuple[Writing, ...]
    faults: tuple[Fault, ...]
    expected: tuple[Expected, ...]
    settings: Mapping[str, str | int]

    @property
    def drives(self) -> bool:
        """It has a master of its own."""
        return bool(self.torques or self.writings)

    def torques_at(self, time: float) -> tuple[float, float, float, float]:
        """Motor torques of the scenario's master at an instant [Nm]."""
        return torques_at(self.torques, time)


def torques_at(steps: Sequence[Torques], time: float) -> tuple[float, float, float, float]:
    """Motor torques (4,) [Nm] that set-points lead to; a ramp begins where the one before it has come to."""
    start = reached = (0.0, 0.0, 0.0, 0.0)
    for number, step in enumerate(steps):
        if step.at > time:
            break
        until = min(time, steps[number + 1].at) if number + 1 < len(steps) else time
        share = 1.0 if step.over == 0.0 else min((until - step.at) / step.over, 1.0)
        fl, rl, fr, rr = (a + share * (b - a) for a, b in zip(start, step.torques, strict=True))
        start = reached = (fl, rl, fr, rr)
    return reached

"""A fault as data, and the line of text that stands for it: `drop@0x181:rate=10%,from=2s,to=3s`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final

from hil.network.cia import ErrorCode
from ident.errors import UserError


class FaultError(UserError):
    """A fault that does not exist, or cannot be injected where it is asked for."""


class FaultKind(StrEnum):
    """What goes wrong."""

    DROP = "drop"
    DELAY = "delay"
    DUPLICATE = "duplicate"
    CORRUPT = "corrupt"
    REORDER = "reorder"
    LENGTH = "length"
    BABBLE = "babble"
    HEARTBEAT = "heartbeat"
    DEATH = "death"
    BUS_OFF = "bus_off"
    POWER = "power"
    TRIP = "trip"
    STUCK = "stuck"
    JUMP = "jump"
    FRICTION = "friction"
    ESTOP = "estop"


class Target(StrEnum):
    """What a kind of fault can befall."""

    FRAMES = "an identifier (0x181), a range (0x180-0x1ff), a node (what it sends), `master` or `all`"
    IDENTIFIER = "an identifier (0x001)"
    SENDER = "a node, or `master`"
    NODE = "a node"
    DRIVE = "a drive"
    MASTER = "`master`"
    VEHICLE = "`vehicle`"
    GROUND = "`floor`, or a wheel (wheel_fl, wheel_rl, wheel_fr, wheel_rr)"


@dataclass(frozen=True)
class Parameter:
    """A number that a fault takes: its default, its range, and what it means."""

    default: float
    low: float
    high: float
    what: str


@dataclass(frozen=True)
class Specification:
    """What a kind of fault does, where, and which numbers it takes besides `from` and `to`."""

    target: Target
    what: str
    parameters: Mapping[str, Parameter] = field(default_factory=dict)


_RATE: Final = Parameter(1.0, 0.0, 1.0, "share of the frames")
_COUNT: Final = Parameter(math.inf, 1, math.inf, "at most so many frames")
_FRAME: Final = {"rate": _RATE, "count": _COUNT}

SPECIFICATIONS: Final[Mapping[FaultKind, Specification]] = {
    FaultKind.DROP: Specification(Target.FRAMES, "frames are lost", _FRAME),
    FaultKind.DELAY: Specification(
        Target.FRAMES,
        "frames come late",
        _FRAME
        | {
            "time": Parameter(0.005, 0.0, 60.0, "by so much [s]"),
            "jitter": Parameter(0.0, 0.0, 60.0, "and up to so much more, uniformly [s]"),
        },
    ),
    FaultKind.DUPLICATE: Specification(
        Target.FRAMES, "frames come again", _FRAME | {"copies": Parameter(1, 1, 100, "so many times more")}
    ),
    FaultKind.CORRUPT: Specification(
        Target.FRAMES, "bits of the data are flipped", _FRAME | {"bits": Parameter(1, 1, 64, "so many, at random")}
    ),
    FaultKind.REORDER: Specification(
        Target.FRAMES,
        "frames let later ones overtake them",
        _FRAME | {"depth": Parameter(1, 1, 100, "so many later ones that match")},
    ),
    FaultKind.LENGTH: Specification(
        Target.FRAMES,
        "frames have another length",
        _FRAME | {"bytes": Parameter(-1, -8, 8, "so many bytes more, or less")},
    ),
    FaultKind.BABBLE: Specification(
        Target.IDENTIFIER,
        "a node sends without end",
        {
            "rate": Parameter(1000.0, 0.001, 20000.0, "frames a second"),
            "length": Parameter(0, 0, 8, "bytes of data in each"),
        },
    ),
    FaultKind.HEARTBEAT: Specification(Target.SENDER, "heartbeats are lost, all else goes on"),
    FaultKind.DEATH: Specification(Target.MASTER, "nothing that the master sends arrives any more"),
    FaultKind.BUS_OFF: Specification(Target.NODE, "the CAN controller is bus-off; at the end it recovers (EMCY 8140h)"),
    FaultKind.POWER: Specification(Target.NODE, "the supply is off; at the end the node boots"),
    FaultKind.TRIP: Specification(
        Target.DRIVE,
        "the drive trips once",
        {"code": Parameter(ErrorCode.CONTINUOUS_OVER_CURRENT, 0x1000, 0xFFFF, "error code 603Fh")},
    ),
    FaultKind.STUCK: Specification(Target.NODE, "the encoder stays at its count"),
    FaultKind.JUMP: Specification(
        Target.NODE,
        "the encoder is off by a number of counts",
        {"counts": Parameter(1000, -(2**31), 2**31 - 1, "so many")},
    ),
    FaultKind.FRICTION: Specification(
        Target.GROUND,
        "the ground is slippery",
        {"value": Parameter(0.1, 0.0, 2.0, "coefficient of friction between tyre and floor")},
    ),
    FaultKind.ESTOP: Specification(
        Target.VEHICLE, "the emergency stop is pressed: no drive has power until it is released (EMCY 9000h)"
    ),
}
"""Everything that can be injected; the parser, the help and the tests walk this table."""

_UNITS: Final = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "%": 1e-2, "/s": 1.0}


@dataclass(frozen=True)
class Fault:
    """One fault.

    Attributes:
        kind: what goes wrong.
        place: where, in the words of the kind's `Target`.
        start, end: when [s], counted from the instant in which it is injected.
        parameters: numbers of the kind that differ from their defaults.

    Raises:
        FaultError: the kind has no such parameter, a number is out of range, or it ends before it starts.
    """

    kind: FaultKind
    place: str
    start: float = 0.0
    end: float = math.inf
    parameters: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not 0.0 <= self.start <= self.end:
            raise FaultError(f"{self.kind} from {self.start:g} s to {self.end:g} s cannot be.", "Let it start first.")
        known = SPECIFICATIONS[self.kind].parameters
        for name, value in self.parameters.items():
            if name not in known:
                raise _unknown(f"{self.kind} takes no {name!r}", ["from", "to", *known])
            if not known[name].low <= value <= known[name].high:
                raise FaultError(
                    f"{self.kind}: {name} = {value:g} is out of range.",
                    f"Give {known[name].low:g} to {known[name].high:g}.",
                )

    def number(self, name: str) -> float:
        """A parameter of its kind, the default where it is not given."""
        return self.parameters.get(name, SPECIFICATIONS[self.kind].parameters[name].default)

    def __str__(self) -> str:
        given = {"from": self.start, "to": self.end} | dict(self.parameters)
        numbers = [f"{name}={value!r}" for name, value in given.items() if (name, value) not in _ALWAYS]
        return f"{self.kind}@{self.place}" + (":" + ",".join(numbers) if numbers else "")


_ALWAYS: Final = {("from", 0.0), ("to", math.inf)}
_DEFAULT_PLACES: Final = {FaultKind.DEATH: "master", FaultKind.FRICTION: "floor", FaultKind.ESTOP: "vehicle"}


def parse_fault(text: str) -> Fault:
    """Read `KIND@PLACE:NAME=NUMBER,...`; numbers may carry s, ms, us, % or /s, and may be hexadecimal.

    Raises:
        FaultError: with what is wrong in it.
    """
    head, _, tail = text.strip().partition(":")
    word, _, place = head.partition("@")
    try:
        kind = FaultKind(word.strip())
    except ValueError:
        raise _unknown(f"There is no fault {word!r}", list(FaultKind)) from None
    place = place.strip() or _DEFAULT_PLACES.get(kind, "")
    if not place:
        raise FaultError(f"{text!r} does not say where.", f"Name {SPECIFICATIONS[kind].target}: {kind}@PLACE.")
    numbers = dict(_assignment(part) for part in tail.split(",") if part.strip())
    start, end = numbers.pop("from", 0.0), numbers.pop("to", math.inf)
    return Fault(kind, place, start, end, numbers)


def parse_script(text: str) -> list[Fault]:
    """Read one fault a line; `#` begins a comment.

    Raises:
        FaultError: with the line that is wrong.
    """
    lines = enumerate((line.partition("#")[0].strip() for line in text.splitlines()), start=1)
    faults = []
    for number, line in lines:
        try:
            faults += [parse_fault(line)] if line else []
        except FaultError as error:
            raise FaultError(f"Line {number}: {error.what}", error.remedy) from error
    return faults


def _assignment(part: str) -> tuple[str, float]:
    name, equals, value = (word.strip() for word in part.partition("="))
    if not equals:
        raise FaultError(f"{part.strip()!r} is not NAME=NUMBER.", "Write for example rate=10%.")
    return name, _number(value)


def _number(text: str) -> float:
    for unit in sorted(_UNITS, key=len, reverse=True):
        if text.endswith(unit):
            return _plain(text.removesuffix(unit), text) * _UNITS[unit]
    return _plain(text, text)


def _plain(digits: str, text: str) -> float:
    try:
        return float(int(digits, 16)) if digits.lower().startswith(("0x", "-0x")) else _not_nan(float(digits))
    except ValueError:
        raise FaultError(f"{text!r} is not a number.", f"Units are {', '.join(_UNITS)}.") from None


def _not_nan(value: float) -> float:
    if math.isnan(value):
        raise ValueError
    return value


def _unknown(what: str, known: list[str]) -> FaultError:
    return FaultError(f"{what}.", f"Use one of {', '.join(known)}.")

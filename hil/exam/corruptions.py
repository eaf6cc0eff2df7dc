"""Corruptions: what recorders, cables, units and signs do to the channels of a sound record."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.records.record import Record, Segment

Array = NDArray[np.float64]
Change = Callable[[Array], Array]

_FIELDS: Final = {
    **{f"torque_{wheel}": ("motor_torques", column) for column, wheel in enumerate(("fl", "rl", "fr", "rr"))},
    **{f"beta_{wheel}": ("wheel_angles", column) for column, wheel in enumerate(("fl", "rl", "fr", "rr"))},
    **{f"alpha_{side}": ("steering_angles", column) for column, side in enumerate("lr")},
}


@dataclass(frozen=True)
class Corruption:
    """What is done to a record, and what it is called.

    Attributes:
        name, channel, step: as a fault names them.
        apply: record -> corrupted record.
        value: that the fault must state, NaN where none is asked for.
    """

    name: str
    channel: str
    step: str
    apply: Callable[[Record], Record]
    value: float = math.nan

    def __str__(self) -> str:
        return f"{self.name}@{self.channel} {self.value:g}" + (f" in {self.step}" if self.step else "")


def _members(channel: str) -> list[str]:
    """A channel, both of a pair, or all of a group."""
    return [name for part in channel.split("/") for name in _FIELDS if name == part or name.split("_")[0] == part]


def _values_of(segment: Segment, channel: str) -> Array:
    name, column = _FIELDS[channel]
    values: Array = getattr(segment, name)
    return values[:, column]


def _with_values(segment: Segment, channel: str, values: Array) -> Segment:
    name, column = _FIELDS[channel]
    stacked: Array = getattr(segment, name).copy()
    stacked[:, column] = values
    if name == "motor_torques":
        return replace(segment, motor_torques=stacked)
    return (
        replace(segment, wheel_angles=stacked) if name == "wheel_angles" else replace(segment, steering_angles=stacked)
    )


def _in_segments(step: str, change: Callable[[Segment], Segment]) -> Callable[[Record], Record]:
    def apply(record: Record) -> Record:
        return replace(record, segments=[change(s) if step in ("", s.step) else s for s in record.segments])

    return apply


def _of_values(name: str, channel: str, step: str, change: Change, value: float = math.nan) -> Corruption:
    def changed(segment: Segment) -> Segment:
        for each in _members(channel):
            segment = _with_values(segment, each, change(_values_of(segment, each)))
        return segment

    return Corruption(name, channel, step, _in_segments(step, changed), value)


def swapped(channel: str, step: str = "") -> Corruption:
    """Two channels, named with a slash between them, in each other's place."""
    one, other = channel.split("/")

    def changed(segment: Segment) -> Segment:
        first, second = _values_of(segment, one), _values_of(segment, other)
        return _with_values(_with_values(segment, one, second), other, first)

    return Corruption("channel_swapped", channel, step, _in_segments(step, changed))


def negated(channel: str, step: str = "") -> Corruption:
    """A channel, or a group, of the other sign."""
    return _of_values("sign_flipped", channel, step, lambda values: -values)


def scaled(channel: str, factor: float, step: str = "") -> Corruption:
    """A channel, or a group, times a factor."""
    return _of_values("scaled", channel, step, lambda values: factor * values, factor)


def late(channel: str, delay: float) -> Corruption:
    """A channel, or a group, later by a delay [s]."""

    def changed(segment: Segment) -> Segment:
        for each in _members(channel):
            moved = np.interp(segment.time - delay, segment.time, _values_of(segment, each))
            segment = _with_values(segment, each, moved)
        return segment

    return Corruption("unsynchronised", channel, "", _in_segments("", changed), delay)


def frozen(channel: str, step: str = "", since: float = 0.3) -> Corruption:
    """A channel that keeps the value that it has after a share of a step."""

    def held(values: Array) -> Array:
        begin = int(since * len(values))
        return np.where(np.arange(len(values)) < begin, values, values[begin])

    return _of_values("frozen", channel, step, held)


def _in_part(name: str, channel: str, part: float, step: str, change: Callable[[Array, float], Array]) -> Corruption:
    """A change by a level that is a part of the largest value that the channels reach where it is made."""

    def apply(record: Record) -> Record:
        touched = [segment for segment in record.segments if step in ("", segment.step)]
        most = max(float(np.abs(_values_of(segment, each)).max()) for segment in touched for each in _members(channel))
        return _of_values(name, channel, step, lambda values: change(values, part * most)).apply(record)

    return Corruption(name, channel, step, apply)


def clipped(channel: str, part: float, step: str = "") -> Corruption:
    """A channel cut off at a part of its largest value."""
    return _in_part("clipped", channel, part, step, lambda values, level: np.clip(values, -level, level))


def wrapped(channel: str, part: float, step: str = "") -> Corruption:
    """A channel that comes around at a part of its largest value."""

    def wrap(values: Array, level: float) -> Array:
        return np.asarray((values + level) % (2 * level) - level)

    return _in_part("wrapped", channel, part, step, wrap)


def cut(step: str, samples: int, *, renumbered: bool) -> Corruption:
    """Samples taken out of the middle of a step; time goes on as if nothing was, or shows the gap."""

    def changed(segment: Segment) -> Segment:
        rates = np.abs(np.diff(segment.wheel_angles, axis=0)).sum(axis=1)
        middle = len(segment) // 3 + int(np.argmax(rates[len(segment) // 3 : len(segment) // 2]))
        kept = np.ones(len(segment), dtype=bool)
        kept[middle : middle + samples] = False
        time = segment.time[: kept.sum()] if renumbered else segment.time[kept]
        return replace(
            segment,
            time=time,
            motor_torques=segment.motor_torques[kept],
            wheel_angles=segment.wheel_angles[kept],
            steering_angles=segment.steering_angles[kept],
            period=segment.period[kept],
            command_torques=None,
            extra={},
        )

    return Corruption("lost_samples", "time", step, _in_segments(step, changed), samples)


def clock(factor: float) -> Corruption:
    """Stamps times a factor."""

    def changed(segment: Segment) -> Segment:
        return replace(segment, time=factor * segment.time, sample_time=factor * segment.sample_time)

    return Corruption("scaled", "time", "", _in_segments("", changed), factor)


_WHEELS: Final = ("fl", "rl", "fr", "rr")
_MADE: Final[Mapping[str, Callable[[str, str, float], Corruption]]] = MappingProxyType(
    {
        "channel_swapped": lambda channel, step, _: swapped(channel, step),
        "sign_flipped": lambda channel, step, _: negated(channel, step),
        "scaled": lambda channel, step, value: clock(value) if channel == "time" else scaled(channel, value, step),
        "unsynchronised": lambda channel, _, value: late(channel, value),
        "frozen": lambda channel, step, value: frozen(channel, step, value),
        "clipped": lambda channel, step, value: clipped(channel, value, step),
        "wrapped": lambda channel, step, value: wrapped(channel, value, step),
    }
)


def corruption_of(name: str, channel: str, step: str, value: float) -> Corruption:
    """A corruption by name; the value is its factor, delay [s], part or share, whatever it has."""
    return _MADE[name](channel, step, value)


def draw_corruption(generator: np.random.Generator) -> tuple[str, str, str, float]:
    """Name, channel, step (all) and value of a corruption, all names alike; a value of 0 where it has none.

    Lost samples are not among them: how long a record is would tell.
    """
    name = str(generator.choice(list(_MADE)))
    return name, _draw_channel(name, generator), "", _draw_value(name, generator)


def _draw_channel(name: str, generator: np.random.Generator) -> str:
    # Encoders count around, torques do not.
    kind = "beta" if name == "wrapped" else str(generator.choice(["torque", "beta"]))
    if name == "channel_swapped":
        one, other = sorted(generator.choice(len(_WHEELS), size=2, replace=False).tolist())
        return f"{kind}_{_WHEELS[one]}/{kind}_{_WHEELS[other]}"
    single = [f"{kind}_{wheel}" for wheel in _WHEELS] + ["alpha_l", "alpha_r"]
    whole = ["torque", "beta", "alpha", *(["time"] if name == "scaled" else [])]
    groups = whole if name in ("sign_flipped", "scaled", "unsynchronised") else []
    return str(generator.choice([*single, *groups]))


def _draw_value(name: str, generator: np.random.Generator) -> float:
    match name:
        case "scaled":
            return float(np.exp(generator.uniform(math.log(1.6), math.log(1e3)) * generator.choice([-1, 1])))
        case "unsynchronised":
            return float(generator.uniform(0.03, 0.12))
        case "frozen":
            return float(generator.uniform(0.0, 0.5))
        case "clipped" | "wrapped":
            return float(generator.uniform(0.3, 0.6))
        case _:
            return 0.0

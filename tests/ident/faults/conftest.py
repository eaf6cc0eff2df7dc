"""Corruptions: what recorders, cables, units and signs do to the channels of a sound record."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.records.record import Record, Segment

Array = NDArray[np.float64]
Change = Callable[[Array], Array]

FIELDS = {
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


def members(channel: str) -> list[str]:
    """A channel, both of a pair, or all of a group."""
    return [name for part in channel.split("/") for name in FIELDS if name == part or name.split("_")[0] == part]


def values_of(segment: Segment, channel: str) -> Array:
    name, column = FIELDS[channel]
    values: Array = getattr(segment, name)
    return values[:, column]


def with_values(segment: Segment, channel: str, values: Array) -> Segment:
    name, column = FIELDS[channel]
    stacked: Array = getattr(segment, name).copy()
    stacked[:, column] = values
    if name == "motor_torques":
        return replace(segment, motor_torques=stacked)
    return (
        replace(segment, wheel_angles=stacked) if name == "wheel_angles" else replace(segment, steering_angles=stacked)
    )


def in_segments(step: str, change: Callable[[Segment], Segment]) -> Callable[[Record], Record]:
    def apply(record: Record) -> Record:
        return replace(record, segments=[change(s) if step in ("", s.step) else s for s in record.segments])

    return apply


def of_values(name: str, channel: str, step: str, change: Change, value: float = math.nan) -> Corruption:
    def changed(segment: Segment) -> Segment:
        for each in members(channel):
            segment = with_values(segment, each, change(values_of(segment, each)))
        return segment

    return Corruption(name, channel, step, in_segments(step, changed), value)


def swapped(channel: str, step: str = "") -> Corruption:
    one, other = channel.split("/")

    def changed(segment: Segment) -> Segment:
        first, second = values_of(segment, one), values_of(segment, other)
        return with_values(with_values(segment, one, second), other, first)

    return Corruption("channel_swapped", channel, step, in_segments(step, changed))


def negated(channel: str, step: str = "") -> Corruption:
    return of_values("sign_flipped", channel, step, lambda values: -values)


def scaled(channel: str, factor: float, step: str = "") -> Corruption:
    return of_values("scaled", channel, step, lambda values: factor * values, factor)


def late(channel: str, delay: float) -> Corruption:
    def changed(segment: Segment) -> Segment:
        for each in members(channel):
            moved = np.interp(segment.time - delay, segment.time, values_of(segment, each))
            segment = with_values(segment, each, moved)
        return segment

    return Corruption("unsynchronised", channel, "", in_segments("", changed), delay)


def frozen(channel: str, step: str = "", since: float = 0.3) -> Corruption:
    def held(values: Array) -> Array:
        begin = int(since * len(values))
        return np.where(np.arange(len(values)) < begin, values, values[begin])

    return of_values("frozen", channel, step, held)


def in_part(name: str, channel: str, part: float, step: str, change: Callable[[Array, float], Array]) -> Corruption:
    """A change by a level that is a part of the largest value that the channels reach where it is made."""

    def apply(record: Record) -> Record:
        touched = [segment for segment in record.segments if step in ("", segment.step)]
        most = max(float(np.abs(values_of(segment, each)).max()) for segment in touched for each in members(channel))
        return of_values(name, channel, step, lambda values: change(values, part * most)).apply(record)

    return Corruption(name, channel, step, apply)


def clipped(channel: str, part: float, step: str = "") -> Corruption:
    return in_part("clipped", channel, part, step, lambda values, level: np.clip(values, -level, level))


def wrapped(channel: str, part: float, step: str = "") -> Corruption:
    def wrap(values: Array, level: float) -> Array:
        return np.asarray((values + level) % (2 * level) - level)

    return in_part("wrapped", channel, part, step, wrap)


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

    return Corruption("lost_samples", "time", step, in_segments(step, changed), samples)


def clock(factor: float) -> Corruption:
    def changed(segment: Segment) -> Segment:
        return replace(segment, time=factor * segment.time, sample_time=factor * segment.sample_time)

    return Corruption("scaled", "time", "", in_segments("", changed), factor)


DEGREES = 180 / math.pi

ALL = (
    *(
        swapped(f"torque_{one}/torque_{other}")
        for one, other in (("fl", "rl"), ("fl", "fr"), ("rl", "rr"), ("fr", "rr"))
    ),
    *(swapped(f"beta_{one}/beta_{other}") for one, other in (("fl", "rl"), ("fl", "rr"), ("fr", "rr"))),
    swapped("alpha_l/alpha_r"),
    *(negated(channel) for channel in ("torque_fr", "torque", "beta_fr", "beta", "alpha_l", "alpha_r", "alpha")),
    *(scaled("torque", factor) for factor in (1000.0, 0.001, 20.0, 2.0)),
    *(scaled(channel, factor) for channel, factor in (("torque_rl", 2.0), ("torque_rr", 10.0), ("beta_fr", 2.0))),
    *(scaled(channel, DEGREES) for channel in ("beta", "alpha_l", "alpha")),
    *(scaled(channel, factor) for channel, factor in (("alpha_r", 0.5), ("beta", 20.0))),
    *(late(channel, delay) for channel, delay in (("torque", 0.02), ("torque", 0.006), ("torque_fr", 0.05))),
    *(
        late(channel, delay)
        for channel, delay in (("beta", 0.02), ("beta_fl", 0.02), ("alpha_r", 0.05), ("alpha", 0.1))
    ),
    swapped("torque_fl/torque_rl", "steering_left"),
    swapped("beta_fl/beta_rl", "steering_left"),
    negated("torque", "straight"),
    negated("beta_rr", "rotation"),
    negated("alpha_l", "steering_left"),
    scaled("torque", 10.0, "straight"),
    *(frozen(channel, since=0.0) for channel in ("beta_rl", "torque_rl", "alpha_l")),
    frozen("beta_fl", "straight"),
    frozen("torque_fr", "rotation"),
    frozen("alpha_r", "steering_right"),
    clipped("torque_fl", 0.5),
    clipped("torque_rr", 0.6, "straight"),
    clipped("beta_fr", 0.3),
    clipped("alpha_l", 0.6, "steering_left"),
    wrapped("beta_fl", 0.4),
    wrapped("beta", 0.4),
    wrapped("alpha_l", 0.5, "steering_left"),
    wrapped("torque_rl", 0.6, "straight"),
    cut("straight", 40, renumbered=False),
    cut("straight", 40, renumbered=True),
    clock(1e3),
    clock(1e6),
    clock(2.0),
)


@pytest.fixture(scope="session")
def corruptions() -> tuple[Corruption, ...]:
    """Sixty or so, over all names, single channels, pairs and groups, all steps or one."""
    return ALL

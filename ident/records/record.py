"""A record in memory: one row per sample, SI, vehicle signs, one or more steps behind each other.

| channel | shape | unit | meaning |
|---|---|---|---|
| time | (N,) | s | uniform within a step |
| step | (N,) | - | name of the step that the sample belongs to |
| torque_{fl,rl,fr,rr} | (N, 4) | Nm | at the motor shaft, as the drive reports it |
| beta_{fl,rl,fr,rr} | (N, 4) | rad | rolling angle of a wheel, positive rolls the vehicle forward |
| alpha_l, alpha_r | (N, 2) | rad | steering angle of the front wheel of a side |
| command_torque_{fl,...} | (N, 4) | Nm | optional: commanded at the motor shaft |
| period | (N,) | - | optional: number of the repeat within the step, -1 outside of any |
"""

from __future__ import annotations

import enum
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ident.errors import RecordError

Array = NDArray[np.float64]

UNIFORMITY = 0.02
"""Largest deviation of a sample interval from the median one, as a fraction of it."""


class Step(enum.StrEnum):
    """Steps that a campaign knows; a record may hold steps of other names, which the estimator passes over."""

    WHEEL_LIFTED = "wheel_lifted"
    STEERING_LEFT = "steering_left"
    STEERING_RIGHT = "steering_right"
    STRAIGHT = "straight"
    ALIGNMENT = "alignment"
    ROTATION = "rotation"
    LATERAL = "lateral"
    LANE_CHANGE = "lane_change"


@dataclass(frozen=True)
class Segment:
    """One uninterrupted run of one step.

    Attributes:
        step: its name.
        sample_time: [s].
        time: (N,) [s].
        motor_torques, wheel_angles: (N, 4) [Nm, rad].
        steering_angles: (N, 2) [rad].
        period: (N,) number of the repeat, -1 outside of any.
        command_torques: (N, 4) [Nm] or None.
        extra: further channels by name, (N,).
    """

    step: str
    sample_time: float
    time: Array
    motor_torques: Array
    wheel_angles: Array
    steering_angles: Array
    period: NDArray[np.int64]
    command_torques: Array | None = None
    extra: Mapping[str, Array] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.time)

    @property
    def periods(self) -> list[int]:
        """Numbers of the complete repeats."""
        return [int(number) for number in np.unique(self.period) if number >= 0]


@dataclass(frozen=True)
class Record:
    """Segments in the order in which they were driven.

    Attributes:
        segments: non-empty.
        source: where the record was read from, for messages.
    """

    segments: Sequence[Segment]
    source: str = "record"

    def of(self, step: str) -> Iterator[Segment]:
        """Segments of one step."""
        return (segment for segment in self.segments if segment.step == step)

    @property
    def steps(self) -> list[str]:
        """Names of the steps in order of first appearance."""
        return list(dict.fromkeys(segment.step for segment in self.segments))

    @property
    def sample_time(self) -> float:
        """Of the first segment [s]."""
        return self.segments[0].sample_time

    @property
    def duration(self) -> float:
        """Driven time of all segments [s]."""
        return sum(len(segment) * segment.sample_time for segment in self.segments)


def make_segment(segment: Segment, source: str) -> Segment:
    """Check a segment and set its sample time from its time channel.

    Raises:
        RecordError: fewer than ten samples, a value that is not finite, or time that is not uniform.
    """
    where = f"{source}, step {segment.step!r}"
    if len(segment) < 10:
        raise RecordError(f"{where} holds {len(segment)} samples.", "A step needs at least ten.")
    _refuse_nonfinite(segment, where)
    return replace(segment, sample_time=_uniform_sample_time(segment.time, where))


def _refuse_nonfinite(segment: Segment, where: str) -> None:
    channels: dict[str, Array] = {
        "time": segment.time,
        "torque": segment.motor_torques,
        "beta": segment.wheel_angles,
        "alpha": segment.steering_angles,
    }
    for name, values in channels.items():
        bad = np.flatnonzero(~np.isfinite(values.reshape(len(values), -1)).all(axis=1))
        if bad.size:
            raise RecordError(
                f"{where}: channel {name} has {bad.size} samples that are not numbers, "
                f"the first at sample {bad[0]} of the step.",
                "Cut that part out, or record it again.",
            )


def _uniform_sample_time(time: Array, where: str) -> float:
    intervals = np.diff(time)
    sample_time = float(np.median(intervals))
    if sample_time <= 0:
        raise RecordError(f"{where}: time does not increase.", "Give time in seconds, increasing.")
    worst = int(np.argmax(np.abs(intervals - sample_time)))
    if abs(intervals[worst] - sample_time) > UNIFORMITY * sample_time:
        raise RecordError(
            f"{where}: time is not uniform: {intervals[worst] * 1e3:.3f} ms after t = {time[worst]:.4f} s "
            f"where {sample_time * 1e3:.3f} ms are usual.",
            "Resample the record, or give the gap's sides different step names.",
        )
    return float((time[-1] - time[0]) / (len(time) - 1))

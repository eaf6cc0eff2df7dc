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
| payload | (N,) | kg | optional: mass of a known load over the centre, the same throughout a step; none: no load |
"""

from __future__ import annotations

import enum
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.errors import RecordError
from ident.records.checks import refuse_lone_samples, refuse_nonfinite, refuse_short, uniform_sample_time
from ident.vehicle.geometry import WHEELS

Array = NDArray[np.float64]

PAYLOAD: Final = "payload"
"""Channel that holds the mass of a known load [kg]."""


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


FOUR_STEPS: Final = (Step.STEERING_LEFT, Step.STEERING_RIGHT, Step.STRAIGHT, Step.ROTATION)
"""Of the paper, section 6: without them nothing is identified."""


def base_step(name: str) -> Step | None:
    """The known step that a step is a variant of: `straight` for itself and for `straight_dither`.

    A variant is named by the step, an underscore, and what is different; it is driven in the same mode and moves the
    same coordinate, so the same equations hold.

    Args:
        name: of a step in a record.

    Returns:
        The step, None for a user's own step of another kind.
    """
    matching = [step for step in Step if name == step or name.startswith(f"{step}_")]
    return max(matching, key=len, default=None)


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
    def payload(self) -> float:
        """Mass of a known load [kg]; 0 without any."""
        return float(self.extra[PAYLOAD][0]) if PAYLOAD in self.extra else 0.0

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
        notes: what a reader had to repair, for people.
    """

    segments: Sequence[Segment]
    source: str = "record"
    notes: tuple[str, ...] = ()

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
        RecordError: fewer than ten samples, a value that is not finite or that stands alone, time that is not uniform,
            or a load that is negative or changes.
    """
    where = f"{source}, step {segment.step!r}"
    refuse_short(len(segment), where)
    for name, values in _measured_channels(segment):
        refuse_nonfinite(name, values, where)
        if name != "time":
            refuse_lone_samples(name, values, where)
    load = segment.extra.get(PAYLOAD)
    if load is not None and (np.ptp(load) or load[0] < 0):
        raise RecordError(
            f"{where}: channel {PAYLOAD} is negative or changes.",
            "Give the mass of the load in kg, the same throughout a step; give a step with another load another name.",
        )
    return replace(segment, sample_time=uniform_sample_time(segment.time, where))


def _measured_channels(segment: Segment) -> Iterator[tuple[str, Array]]:
    yield "time", segment.time
    for column, wheel in enumerate(WHEELS):
        yield f"torque_{wheel}", segment.motor_torques[:, column]
        yield f"beta_{wheel}", segment.wheel_angles[:, column]
    for column, side in enumerate("lr"):
        yield f"alpha_{side}", segment.steering_angles[:, column]

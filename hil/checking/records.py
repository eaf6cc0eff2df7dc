"""Whether a record can be of a vehicle: steps, sample rate, ranges, and the lengths that wheels and steering show.

Faults of the record are those of `ident.faults`, impossible signals those of the assessment of results.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final

import numpy as np

from hil.checking.findings import Finding, Severity
from hil.network.described import Described
from ident.assessment.signals import signal_reasons
from ident.campaign.steps import DRIVING_ORDER
from ident.faults import FaultName, find_faults
from ident.records.record import FOUR_STEPS, Record, Segment, Step, base_step
from ident.vehicle.geometry import WHEELS

RATE_TOLERANCE: Final = 0.01
"""Relative difference of sample time and bus cycle that is still the same."""

LEVER_TOLERANCE: Final = 0.01
"""Relative, of the wheel rolling per steering motion at standstill: more than creep and play do to it."""

LEAST_STEERING: Final = 0.1
"""Range of a steering angle from which the lever is estimated [rad]."""

_SIDES: Final = {Step.STEERING_LEFT: (0, (0, 1)), Step.STEERING_RIGHT: (1, (2, 3))}
"""Steering steps: which encoder, and which wheels roll."""


def check_records(record: Record, described: Described) -> list[Finding]:
    """Whether a record can be of a vehicle.

    Args:
        record: as read.
        described: the vehicle and its network.
    """
    checks: tuple[Callable[[Record, Described], Iterator[Finding]], ...] = (
        _notes,
        _steps,
        _segments,
        _signals,
        _faults,
    )
    return [finding for check in checks for finding in check(record, described)]


def _notes(record: Record, _described: Described) -> Iterator[Finding]:
    """What a reader had to repair."""
    for note in record.notes:
        remedy = "Check cycle_period of the network file, and what else ran on the master's computer."
        yield Finding(Severity.WARNING, "repaired", record.source, note, remedy)


def _steps(record: Record, _described: Described) -> Iterator[Finding]:
    driven = {segment.step for segment in record.segments}
    for step in sorted(step for step in driven if base_step(step) is None):
        yield Finding(
            Severity.WARNING,
            "step_unknown",
            record.source,
            f"Step {step!r} is none of a campaign.",
            f"It is passed over; the steps are {', '.join(DRIVING_ORDER)}.",
        )
    missing = [step for step in FOUR_STEPS if step not in driven]
    if missing:
        yield Finding(
            Severity.WARNING,
            "step_missing",
            record.source,
            f"There is no {', '.join(missing)}.",
            "An identification needs all four; give the other records too.",
        )


def _segments(record: Record, described: Described) -> Iterator[Finding]:
    for segment in record.segments:
        for check in (_rate, _lever):
            yield from check(segment, f"{record.source}, step {segment.step}", described)


def _signals(record: Record, described: Described) -> Iterator[Finding]:
    """Torques, speeds and angles that the vehicle cannot have."""
    for reason in signal_reasons(record, described.vehicle):
        remedy = f"Check the units of the record and {described.vehicle.path}."
        yield Finding(Severity.ERROR, reason.code, f"{record.source}, {reason.channel}", reason.text, remedy)


def _faults(record: Record, described: Described) -> Iterator[Finding]:
    """What a recorder, a cable or a sign has done to channels."""
    for fault in find_faults(record, described.vehicle):
        if fault.sure:
            text = f"The record is at fault: {fault.text}."
            severity = Severity.WARNING if fault.name is FaultName.LOST else Severity.ERROR
            yield Finding(severity, fault.name, f"{record.source}, {fault.channel}", text, fault.remedy, fault)


def _rate(segment: Segment, where: str, described: Described) -> Iterator[Finding]:
    cycle = described.network.cycle_period
    if abs(segment.sample_time - cycle) > RATE_TOLERANCE * cycle:
        yield Finding(
            Severity.WARNING,
            "sample_rate",
            where,
            f"It is sampled every {segment.sample_time * 1e3:.4g} ms, the bus has a cycle of {cycle * 1e3:.4g} ms.",
            "Check that time is in s and that the network file is that of the record.",
        )


def _lever(segment: Segment, where: str, described: Described) -> Iterator[Finding]:
    """At standstill wheels roll by a/r of the steering: gear, increments, radius, offset and signs show there."""
    step = base_step(segment.step)
    if step is None or step not in _SIDES:
        return
    side, wheels = _SIDES[step]
    steering = segment.steering_angles[:, side] - segment.steering_angles[:, side].mean()
    if np.ptp(steering) < LEAST_STEERING:
        return
    for wheel, sign in zip(wheels, (-1, 1) if side == 0 else (1, -1), strict=True):
        rolled = float(steering @ segment.wheel_angles[:, wheel] / (steering @ steering))
        expected = sign * described.vehicle.geometry.lever_ratio
        if abs(rolled - expected) > LEVER_TOLERANCE * abs(expected):
            yield Finding(
                Severity.ERROR,
                "lever",
                f"{where}, beta_{WHEELS[wheel]} and alpha_{'lr'[side]}",
                f"The wheel rolls {rolled:+.4f} rad per rad of steering, {described.vehicle.path} says {expected:+.4f} "
                f"(wheel_offset over wheel_radius): a factor of {rolled / expected:.4f}.",
                "Check wheel_offset, wheel_radius and gear_ratio, the increments and directions in the network file, "
                "and units and signs of the record.",
            )

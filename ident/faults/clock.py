"""Faults of time and of counters, at the full rate: units of time, gaps, samples lost in all channels, wraps."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ident.faults.channels import GROUPS, singles
from ident.faults.fault import Fault, FaultName
from ident.faults.hypothesis import TIME
from ident.records.checks import UNIFORMITY
from ident.records.record import Segment

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

INTERVALS: Final = (1e-4, 0.1)
"""Sample intervals [s] at which a vehicle is recorded: faster than any drive answers, slower than any steering."""

TIME_UNITS: Final = (1e3, 1e6, 1e9, 60.0, 1 / 60, 1e-3)
"""What seconds are mistaken for: ms, us, ns; minutes; ks."""

NEARLY: Final = 0.9
"""Part of its range by which a channel jumps between two samples only where a counter wraps."""

ALIKE: Final = 0.05
"""Difference of jumps of one counter, over their size: what is measured moves between two samples as well."""

GRAIN: Final = 20.0
"""A jump is no step of resolution and no noise where it is so many times the usual one."""

WINDOW: Final = 5
"""Samples on either side that tell how far a channel moves between two."""

CERTAIN: Final = 1e3
"""Evidence of what cannot be otherwise."""


def unit_of_time(segments: Sequence[Segment]) -> float:
    """Recorded time over seconds, 1 where the sample intervals can be seconds."""
    interval = float(np.median([segment.sample_time for segment in segments]))
    if INTERVALS[0] <= interval <= INTERVALS[1] or not interval > 0:
        return 1.0
    fitting = [unit for unit in TIME_UNITS if INTERVALS[0] <= interval / unit <= INTERVALS[1]]
    return fitting[0] if fitting else 1.0


def without_gaps(segment: Segment) -> tuple[Segment, list[Fault]]:
    """A segment with its time made uniform, lost samples filled in by straight lines, and what was wrong with it."""
    intervals = np.diff(segment.time)
    usual = float(np.median(intervals))
    if not usual > 0 or np.max(np.abs(intervals - usual)) <= UNIFORMITY * usual:
        return segment, []
    lost = np.maximum(np.round(intervals / usual) - 1, 0)
    if not lost.any():
        spread = float(np.std(intervals))
        fault = Fault(FaultName.LATE, TIME, spread, "s", math.nan, CERTAIN, step=segment.step)
        return replace(segment, sample_time=usual), [fault]
    missing = float(lost.sum())
    fault = Fault(FaultName.LOST, TIME, missing, "samples", 0.0, CERTAIN, True, step=segment.step)
    return _filled(segment, lost, usual), [fault]


def missing_numbers(segment: Segment) -> tuple[Segment, list[Fault]]:
    """A segment with what is no number filled in by straight lines, and which channels held such."""
    faults = []
    for place in singles():
        values = place.of(segment)[:, 0]
        bad = ~np.isfinite(values)
        if bad.any():
            count = float(bad.sum())
            faults.append(
                Fault(FaultName.LOST, place.name, count, "samples", 0.0, CERTAIN, not bad.all(), step=segment.step)
            )
            rows = np.arange(len(values))
            good = np.interp(rows, rows[~bad], values[~bad]) if not bad.all() else np.zeros(len(values))
            segment = place.put(segment, good[:, None])
    return segment, faults


def skipped(segment: Segment) -> tuple[Segment, list[Fault]]:
    """A segment whose encoders all jump at once, as far as they would have moved in samples that are not there."""
    angles = np.hstack([segment.wheel_angles, segment.steering_angles])
    if len(angles) < 4 * WINDOW:
        return segment, []
    moved, usual = np.diff(angles, axis=0), _usual(np.diff(angles, axis=0))
    # A channel that jumps alone is a motor that hits its play or rings on its spring: the others must have jumped too.
    others = np.arange(angles.shape[1]) != np.argmax(usual**2, axis=1)[:, None]
    (ratio, jumps), (_, without) = (_farther(moved, usual, chosen) for chosen in (np.ones_like(others), others))
    jumps &= without
    if not jumps.any():
        return segment, []
    lost = np.where(jumps, np.maximum(np.round(ratio) - 1, 1), 0)
    missing = float(lost.sum())
    fault = Fault(FaultName.LOST, TIME, missing, "samples", math.sqrt(missing), CERTAIN, True, step=segment.step)
    return _filled(segment, lost, segment.sample_time), [fault]


def _farther(moved: Array, usual: Array, chosen: Mask) -> tuple[Array, Mask]:
    """How far some channels move between two samples over what they usually do (N,), and where that is a sample more.

    It is beyond resolution and noise, as far in all channels alike, and at least one whole sample more.
    """
    grain = np.sum(np.median(np.abs(np.diff(moved, axis=0)), axis=0) ** 2 * chosen, axis=1)
    moved, usual = moved * chosen, usual * chosen
    size = np.sum(usual**2, axis=1)
    ratio = np.sum(moved * usual, axis=1) / np.maximum(size, np.finfo(float).tiny)
    left = np.sum((moved - ratio[:, None] * usual) ** 2, axis=1)
    far = (size > GRAIN**2 * grain) & (ratio > 2 - UNIFORMITY * WINDOW) & (left < UNIFORMITY * ratio**2 * size)
    return ratio, np.asarray(far)


def unwrapped(segments: Sequence[Segment]) -> tuple[list[Segment], list[Fault]]:
    """Segments with counters that wrap put together again, and which did."""
    faults = []
    mended = list(segments)
    for place in singles():
        found = {index: jumps for index, segment in enumerate(mended) if (jumps := _jumps(place.of(segment)[:, 0]))}
        if not found:
            continue
        sizes = np.array([abs(size) for jumps in found.values() for _, size in jumps])
        modulus = float(np.median(sizes))
        if np.mean(np.abs(sizes - modulus) < ALIKE * modulus) < NEARLY:
            continue
        for index, jumps in found.items():
            turns = np.zeros(len(mended[index]))
            for row, size in jumps:
                turns[row + 1 :] -= math.copysign(modulus, size)
            mended[index] = place.put(mended[index], place.of(mended[index]) + turns[:, None])
        steps = {mended[index].step for index in found}
        step = steps.pop() if len(steps) == 1 and len(segments) > 1 else ""
        spread = float(np.std(sizes)) if len(sizes) > 1 else math.nan
        unit = place.group.unit
        faults.append(Fault(FaultName.WRAPPED, place.name, modulus, unit, spread, CERTAIN, True, step=step))
    return mended, grouped(faults)


def grouped(faults: Sequence[Fault]) -> list[Fault]:
    """The same fault of all channels of a group in the same steps, as one."""
    for group in GROUPS:
        for name in FaultName:
            mine = [fault for fault in faults if fault.channel in group.members and fault.name is name]
            if len({fault.channel for fault in mine}) == len(group.members) and len({f.step for f in mine}) == 1:
                kept = [fault for fault in faults if fault not in mine]
                faults = [*kept, replace(mine[0], channel=group.name)]
    return list(faults)


def _jumps(values: Array) -> list[tuple[int, float]]:
    """Rows after which a channel (N,) jumps by about its whole range, and how far beyond its usual motion."""
    moved = np.diff(values)
    reach = float(np.ptp(values))
    sizes = np.abs(moved[moved != 0])
    if not sizes.size or reach < GRAIN * float(np.median(sizes)):
        return []
    rows = np.flatnonzero(np.abs(moved) > NEARLY * reach)
    usual = _usual(moved[:, None])[:, 0]
    return [(int(row), float(moved[row] - usual[row])) for row in rows]


def _usual(moved: Array) -> Array:
    """Median of what a channel moves between two samples, about every one, (N, n)."""
    return np.asarray(ndimage.median_filter(moved, size=(2 * WINDOW + 1, 1), mode="nearest"))


def _filled(segment: Segment, lost: Array, interval: float) -> Segment:
    """Samples by straight lines where some are lost, a number after each row but the last (N - 1,)."""
    place = np.concatenate([[0.0], np.cumsum(1 + lost)])
    rows = np.arange(int(place[-1]) + 1)

    def fill(values: Array) -> Array:
        return np.stack([np.interp(rows, place, column) for column in values.T], axis=1)

    nearest = np.searchsorted(place, rows, side="right") - 1
    commands = segment.command_torques
    return replace(
        segment,
        sample_time=interval,
        time=segment.time[0] + rows * interval,
        motor_torques=fill(segment.motor_torques),
        wheel_angles=fill(segment.wheel_angles),
        steering_angles=fill(segment.steering_angles),
        period=segment.period[nearest],
        command_torques=None if commands is None else fill(commands),
        extra={name: values[nearest] for name, values in segment.extra.items()},
    )


def stuck_runs(values: Array, shortest: int) -> Iterator[tuple[int, int]]:
    """Begin and end of the runs of equal values (N,) that are long enough."""
    edges = np.flatnonzero(np.diff(values) != 0) + 1
    bounds = np.concatenate([[0], edges, [len(values)]])
    for begin, end in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        if end - begin >= shortest:
            yield begin, end

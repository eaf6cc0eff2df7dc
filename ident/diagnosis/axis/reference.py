"""What records of axes to fit and to confirm have in common: filters, scales, and how late sampling makes a motion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.axis.acceleration_noise import acceleration_noise, at_most, noise_limit
from ident.diagnosis.axis.motion import (
    FEWEST_ROWS,
    LEAST_BAND,
    ROWS_CUTOFF,
    AxisMotion,
    axis_motion,
    effort_bandwidth,
    repeat_duration,
    sample_noise,
)
from ident.diagnosis.axis.reversals import Sticking, Untold, turned_round, untold_while_sticking
from ident.diagnosis.axis.scale import Scale
from ident.diagnosis.dependence import NEAREST, path_since_reversal
from ident.diagnosis.observations.delays import HELD, delayed
from ident.errors import EstimationError, RecordError
from ident.estimate.axis.cutoff import LARGEST_CUTOFF, position_cutoff
from ident.estimate.axis.processing import BUTTERWORTH_ORDER, PARAMETERS
from ident.estimate.filters import FILTER_ORDER, SEVEN, differentiate, mirrored
from ident.records.axis_record import AxisRecord, AxisSignals
from ident.records.rates import nominal

Array = NDArray[np.float64]

PASSED: Final = 3 * np.pi / (8 * math.sqrt(2))
"""Noise bandwidth of the filter of the rows over its cutoff: the integral of 1 / (1 + x⁴)² over x."""


@dataclass(frozen=True)
class Reference:
    """What records to fit and to confirm must have in common.

    Attributes:
        cutoff: of the position filter [rad/s].
        bandwidth: of the filter that all columns and the effort pass [rad/s].
        scales: of every axis.
        strange: nominal sample times of records that confirm, of which none of the fit is [s].
        noises: log evidence that the noise of an acceleration may be for what is made of it, of every axis.
    """

    cutoff: float
    bandwidth: float
    scales: tuple[Scale, ...]
    strange: tuple[float, ...] = ()
    noises: tuple[float, ...] = ()


@dataclass(frozen=True)
class Signals:
    """Motions of the axes of one record and their filter.

    Attributes:
        record: efforts are those that act at the time of the positions, as far as sampling is why they do not.
        motions: of its axes.
        cutoff: of the position filter [rad/s].
        bandwidth: of the filter of the rows [rad/s].
        scales: of the axes, whose friction turns where they reverse; empty: not known yet.
    """

    record: AxisRecord
    motions: list[AxisMotion]
    cutoff: float
    bandwidth: float
    scales: Sequence[Scale] = ()

    def filtered(self, values: Array) -> Array:
        """The filter of the positions and that of the rows, on everything alike."""
        passes = ((BUTTERWORTH_ORDER, self.cutoff), (FILTER_ORDER, self.bandwidth))
        return mirrored(values, passes, self.record.sample_time)

    @cached_property
    def _untold(self) -> list[Untold]:
        dt = self.record.sample_time
        found = []
        for motion, scale in zip(self.motions, self.scales, strict=True):
            # Efforts that are on time turn with the motion; those that are not lead it.
            lead = round(scale.late / dt) if scale.delayed else 0
            sticking = Sticking(
                where=np.roll(motion.sticking, -lead),
                friction=float(scale.values[PARAMETERS.index("Fc")]),
                noise=sample_noise(motion.effort, dt),
                blur=1 / (self.cutoff * dt),
                ends=turned_round(float(np.abs(motion.velocity).max()), float(scale.values[PARAMETERS.index("M")]), dt),
            )
            found.append(untold_while_sticking(sticking, motion.moving, self.filtered, 1 / (self.bandwidth * dt)))
        return found

    def rows_of(self, index: int, values: Array) -> Array:
        """Values (N,) or (N, m) as rows of an axis: filtered, without what is likely to happen while it may stick."""
        filtered = self.filtered(values)
        return self._untold[index].without(filtered) if self.scales else filtered

    def equations(self, index: int) -> tuple[Array, Array]:
        """Own columns (n, p) of an axis in its moving rows, and its effort (n,) there."""
        motion = self.motions[index]
        columns, effort = self.rows_of(index, own_columns(self.motions, index)), self.rows_of(index, motion.effort)
        return columns[motion.moving], effort[motion.moving]

    def smoothed_columns(self, index: int) -> Array:
        """Columns (N, p) of `own_columns`, of the smoothed motion."""
        motions = self.motions
        own = motions[index]
        columns = [own.acceleration, own.velocity, np.sign(own.velocity), np.ones_like(own.velocity)]
        columns += [motion.acceleration for motion in motions if motion is not own]
        return np.stack(columns, axis=1)


def own_columns(motions: Sequence[AxisMotion], index: int) -> Array:
    """Columns (N, p) that an axis has in the baseline, unfiltered: its own four, the acceleration of each other."""
    motion = motions[index]
    own = [*motion.linear.T, np.sign(motion.velocity), np.ones_like(motion.velocity)]
    own += [other.linear[:, 0] for other in motions if other is not motion]
    return np.stack(own, axis=1)


def axis_reference(
    records: Sequence[AxisRecord], cutoff: float | None = None, others: Sequence[AxisRecord] = ()
) -> Reference:
    """Reference of the records of a fit.

    Args:
        records: of the same axes, at any rates.
        cutoff: of the position filter [rad/s]; None: chosen from the records.
        others: that confirm, at any rates: they must pass the same filters.

    Raises:
        RecordError: the records do not have the same axes.
        EstimationError: a record is too short, or an axis does not move.
    """
    refuse_other_axes(records)
    everyone = [*records, *others]
    chosen = cutoff or min(largest_cutoff(everyone), *(position_cutoff(record, LEAST_BAND) for record in records))
    signals = [axis_signals(record, chosen, ROWS_CUTOFF * chosen) for record in records]
    known = {nominal(record.sample_time) for record in records}
    strange = [record for record in others if nominal(record.sample_time) not in known]
    apart = [axis_signals(record, chosen, ROWS_CUTOFF * chosen) for record in strange]
    alike = [_scale(signals, index) for index in range(len(records[0].axes))]
    scales = tuple(replace(scale, holds=_holds(apart, index, scale.values)) for index, scale in enumerate(alike))
    moving = [np.mean(np.concatenate([one.motions[index].moving for one in signals])) for index in range(len(scales))]
    noises = [
        [
            acceleration_noise(record, axis, scale.values[0], scale.noise, float(part))
            for axis, scale, part in zip(record.axes, scales, moving, strict=True)
        ]
        for record in everyone
    ]
    limit = min(
        noise_limit(record, axis, noise, chosen)
        for record, own in zip(everyone, noises, strict=True)
        for axis, noise in zip(record.axes, own, strict=True)
    )
    bandwidth = max(
        effort_bandwidth(
            one.smoothed_columns(index) @ scale.values, repeat_duration(one.record), limit, one.record.sample_time
        )
        for one in signals
        for index, scale in enumerate(scales)
    )
    return Reference(
        max(chosen, min(bandwidth / ROWS_CUTOFF, largest_cutoff(everyone))),
        bandwidth,
        scales,
        tuple(sorted({nominal(record.sample_time) for record in strange})),
        tuple(at_most(own, bandwidth) for own in zip(*noises, strict=True)),
    )


def largest_cutoff(records: Sequence[AxisRecord]) -> float:
    """Of a position filter, at the rates of these records [rad/s]."""
    return min(2 * np.pi * LARGEST_CUTOFF / record.sample_time for record in records)


def axis_signals(record: AxisRecord, cutoff: float, bandwidth: float, scales: Sequence[Scale] = ()) -> Signals:
    """Motions of the axes of a record, behind their filters.

    Args:
        record: of any axes.
        cutoff, bandwidth: of the filters of the positions and of the rows [rad/s].
        scales: of the axes, whose `hold` the efforts are shifted by, and whose friction turns where they reverse;
            empty: as recorded.

    Raises:
        EstimationError: the record is too short, or an axis does not move.
    """
    if scales:
        axes = [_on_time(axis, scale, record.sample_time) for axis, scale in zip(record.axes, scales, strict=True)]
        record = replace(record, axes=tuple(axes))
    motions = [axis_motion(record, axis, cutoff, bandwidth) for axis in record.axes]
    return Signals(record, motions, cutoff, bandwidth, scales)


def _on_time(axis: AxisSignals, scale: Scale, sample_time: float) -> AxisSignals:
    """The axis with its effort when it acts, where sampling can be why that is not when it is recorded."""
    return replace(axis, effort=delayed(axis.effort, scale.hold_at(sample_time) * sample_time, sample_time))


def refuse_other_axes(records: Sequence[AxisRecord]) -> None:
    """Refuse records of different axes.

    Raises:
        RecordError: they do not all have the same axes, of the same units.
    """
    first = [(axis.name, axis.kind) for axis in records[0].axes]
    for record in records[1:]:
        if [(axis.name, axis.kind) for axis in record.axes] != first:
            raise RecordError(
                f"{record.source} does not have the axes of {records[0].source}.", "Name records of the same axes."
            )


def _scale(signals: Sequence[Signals], index: int) -> Scale:
    motions = [one.motions[index] for one in signals]
    rows = [one.equations(index) for one in signals]
    left, right = np.vstack([row[0] for row in rows]), np.concatenate([row[1] for row in rows])
    record = signals[0].record
    if sum(int(motion.moving.sum()) for motion in motions) * record.sample_time * signals[0].bandwidth < FEWEST_ROWS:
        raise EstimationError(
            f"{record.source}: {record.axes[index].label} hardly moves without reversing.",
            "Record longer strokes, or more of them.",
        )
    values = np.linalg.lstsq(left, right, rcond=None)[0]
    bend = np.concatenate([_lagging(one, index, values)[one.motions[index].moving] for one in signals])
    *refined, lag = np.linalg.lstsq(np.column_stack([left, bend]), right, rcond=None)[0]
    speed = max(float(np.percentile(np.abs(motion.velocity), 95)) for motion in motions)
    slowest = float(np.quantile(np.concatenate([np.abs(one.velocity[one.moving]) for one in motions]), NEAREST))
    paths = [path_since_reversal(one.position, one.velocity)[one.moving] for one in motions]
    reach = float(np.ptp(np.concatenate([motion.position for motion in motions])))
    sampled = abs(lag) <= HELD
    rest = right - np.column_stack([left, bend]) @ [*refined, lag]
    return Scale(
        np.array(refined) if sampled else values,
        speed,
        slowest,
        float(np.quantile(np.concatenate(paths), NEAREST)),
        reach,
        float(lag) if sampled else 0.0,
        0.0 if sampled else float(lag) * record.sample_time,
        float(rest @ rest) / len(rest) / (PASSED * signals[0].bandwidth / (2 * np.pi)),
    )


def _holds(signals: Sequence[Signals], index: int, values: Array) -> dict[float, float]:
    """Lag of an axis at every sample time [s] in such intervals, its parameters (p,) given."""
    sums: dict[float, Array] = {}
    for one in signals:
        moving = one.motions[index].moving
        left, right = one.equations(index)
        bend = _lagging(one, index, values)[moving]
        added = np.array([bend @ (right - left @ values), bend @ bend])
        time = nominal(one.record.sample_time)
        sums[time] = sums.get(time, np.zeros(2)) + added
    return {time: float(product / power) for time, (product, power) in sums.items() if power > 0}


def _lagging(signals: Signals, index: int, values: Array) -> Array:
    """Filtered change (N,) of the effort of a first estimate over a sample interval."""
    dt = signals.record.sample_time
    return signals.rows_of(index, dt * differentiate(signals.smoothed_columns(index) @ values, dt, SEVEN))

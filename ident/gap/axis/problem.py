"""From records of axes to a regression with candidates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.errors import EstimationError, RecordError
from ident.estimate.axis.identify import PARAMETER_UNITS
from ident.estimate.axis.processing import PARAMETERS, smoothed
from ident.estimate.filters import zero_phase
from ident.gap.axis.candidates import AxisModel, axis_candidates
from ident.gap.axis.motion import (
    FEWEST_ROWS,
    LARGEST_CUTOFF,
    ROWS_CUTOFF,
    AxisMotion,
    axis_motion,
    effort_bandwidth,
    noise_limit,
    position_cutoff,
    repeat_duration,
    with_repeats,
)
from ident.gap.problem import Block, Candidate, Channel, Problem, Variant
from ident.records.axis_record import AxisRecord, AxisSignals

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

LOW_SPEED = 0.15
"""Below this part of the usual top speed, a row counts as slow."""
STEP = "motion"


@dataclass(frozen=True)
class Scale:
    """What the candidates of one axis are scaled by, found from the records of the fit.

    Attributes:
        values: own baseline parameters of the axis, a first estimate.
        speed: of which the axis is seldom faster [m/s or rad/s].
        reach: range of its position [m or rad].
    """

    values: Array
    speed: float
    reach: float


@dataclass(frozen=True)
class Reference:
    """What records to fit and to confirm must have in common.

    Attributes:
        cutoff: of the position filter [rad/s].
        bandwidth: of the filter that all columns and the effort pass [rad/s].
        scales: of every axis.
    """

    cutoff: float
    bandwidth: float
    scales: tuple[Scale, ...]


def axis_reference(records: Sequence[AxisRecord], cutoff: float | None = None) -> Reference:
    """Reference of the records of a fit.

    Args:
        records: of the same axes, at any rates.
        cutoff: of the position filter [rad/s]; None: chosen from the records.

    Raises:
        RecordError: the records do not have the same axes.
        EstimationError: a record is too short, or an axis does not move.
    """
    refuse_other_axes(records)
    chosen = cutoff or min(position_cutoff(record) for record in records)
    signals = [_signals(record, chosen, ROWS_CUTOFF * chosen) for record in records]
    scales = tuple(_scale(signals, index) for index in range(len(records[0].axes)))
    limit = min(
        noise_limit(axis, scale.values[0], chosen, record.sample_time)
        for record in records
        for axis, scale in zip(record.axes, scales, strict=True)
    )
    bandwidth = max(
        effort_bandwidth(_first_estimate(one, index, scale), repeat_duration(one.record), limit, one.record.sample_time)
        for one in signals
        for index, scale in enumerate(scales)
    )
    return Reference(max(chosen, min(bandwidth / ROWS_CUTOFF, largest_cutoff(records))), bandwidth, scales)


def largest_cutoff(records: Sequence[AxisRecord]) -> float:
    """Of a position filter, at the rates of these records [rad/s]."""
    return min(2 * np.pi * LARGEST_CUTOFF / record.sample_time for record in records)


def axis_problem(records: Sequence[AxisRecord], reference: Reference) -> Problem:
    """Rows M a + Fv v + Fc sign(v) + offset = effort of every axis of the records, and what might be missing in them.

    With several axes, the acceleration of each stands in the rows of all: inertia couples them, and that is no gap.

    Raises:
        RecordError: the records do not have the same axes, or not those of the reference.
        EstimationError: a record is too short, or an axis does not move.
    """
    refuse_other_axes(records)
    parts = [_of_record(_signals(record, reference.cutoff, reference.bandwidth), reference) for record in records]
    blocks = tuple(block for blocks, _ in parts for block in blocks)
    candidates = _joined([candidates for _, candidates in parts])
    parameters, units = zip(*_baseline_names(records[0].axes), strict=True)
    return Problem(parameters, units, blocks, candidates)


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


def place_of(axis: AxisSignals) -> str:
    """Place of an axis in results."""
    return f"axis_{axis.name}" if axis.name else "axis"


@dataclass(frozen=True)
class _Signals:
    """Motions of the axes of one record and their filter."""

    record: AxisRecord
    motions: list[AxisMotion]
    cutoff: float
    bandwidth: float

    def filtered(self, values: Array) -> Array:
        """The filter of the positions and that of the rows, on everything alike."""
        dt = self.record.sample_time
        return zero_phase(smoothed(values, self.cutoff, dt), self.bandwidth, dt)

    def equations(self, index: int) -> tuple[Array, Array]:
        """Own columns of an axis in its moving rows, and its effort there."""
        places, raw = _baseline(self.motions, index)
        moving = self.motions[index].moving
        return self.filtered(raw[:, places])[moving], self.filtered(self.motions[index].effort)[moving]


def _signals(record: AxisRecord, cutoff: float, bandwidth: float) -> _Signals:
    return _Signals(record, [axis_motion(record, axis, cutoff, bandwidth) for axis in record.axes], cutoff, bandwidth)


def _scale(signals: Sequence[_Signals], index: int) -> Scale:
    motions = [one.motions[index] for one in signals]
    rows = [one.equations(index) for one in signals]
    left, right = np.vstack([row[0] for row in rows]), np.concatenate([row[1] for row in rows])
    record = signals[0].record
    if sum(int(motion.moving.sum()) for motion in motions) * record.sample_time * signals[0].bandwidth < FEWEST_ROWS:
        raise EstimationError(
            f"{record.source}: {record.axes[index].label} hardly moves without reversing.",
            "Record longer strokes, or more of them.",
        )
    speed = max(float(np.percentile(np.abs(motion.velocity), 95)) for motion in motions)
    reach = float(np.ptp(np.concatenate([motion.position for motion in motions])))
    return Scale(np.linalg.lstsq(left, right, rcond=None)[0], speed, reach)


def _first_estimate(signals: _Signals, index: int, scale: Scale) -> Array:
    """Effort (N,) of an axis by a first estimate, from its smoothed motion."""
    motions = signals.motions
    own = [motions[index].acceleration, motions[index].velocity, np.sign(motions[index].velocity)]
    columns = [*own, np.ones_like(own[0]), *(motion.acceleration for motion in motions if motion is not motions[index])]
    return np.asarray(np.stack(columns, axis=1) @ scale.values)


def _settled(signals: _Signals, index: int) -> slice:
    """From the first to the last row of an axis that counts: without the ends, where filters ring."""
    rows = np.flatnonzero(signals.motions[index].moving)
    return slice(int(rows[0]), int(rows[-1]) + 1)


def _of_record(signals: _Signals, reference: Reference) -> tuple[list[Block], list[list[Candidate]]]:
    period = with_repeats(signals.record)
    models = [_model(signals, index, scale) for index, scale in enumerate(reference.scales)]
    blocks = [_block(signals, model, period) for model in models]
    return blocks, [axis_candidates(model) for model in models]


def _model(signals: _Signals, index: int, scale: Scale) -> AxisModel:
    axis, motion = signals.record.axes[index], signals.motions[index]
    places, raw = _baseline(signals.motions, index)
    return AxisModel(
        place=place_of(axis),
        block=index,
        blocks=len(signals.motions),
        kind=axis.kind,
        motion=motion,
        sample_time=signals.record.sample_time,
        filtered=signals.filtered,
        inertia=float(scale.values[0]),
        effort=_first_estimate(signals, index, scale),
        absorbed=np.asarray(raw[:, places] @ scale.values),
        speed=scale.speed,
        reach=scale.reach,
        others=tuple((o.name, m) for o, m in zip(signals.record.axes, signals.motions, strict=True) if m is not motion),
    )


def _block(signals: _Signals, model: AxisModel, period: NDArray[np.int64]) -> Block:
    return Block(
        record=signals.record.source,
        channel=Channel.DYNAMIC,
        step=STEP,
        coordinate=model.place,
        unit=model.kind.effort_unit,
        sample_time=signals.record.sample_time,
        bandwidth=signals.bandwidth,
        target=signals.filtered(model.motion.effort),
        baseline=signals.filtered(_baseline(signals.motions, model.block)[1]),
        moving=model.motion.moving,
        period=period,
        regions=_regions(model.motion, model.speed),
        features=_features(signals.motions),
    )


def _baseline_names(axes: Sequence[AxisSignals]) -> list[tuple[str, str]]:
    """Name and unit of every parameter: four of each axis, then the inertia that couples it to each other axis."""
    named = []
    for axis in axes:
        end = f"_{axis.name}" if axis.name else ""
        named += [(f"{name}{end}", PARAMETER_UNITS[axis.kind][name]) for name in PARAMETERS]
        inertia = PARAMETER_UNITS[axis.kind]["M"]
        named += [(f"M_{axis.name}_{other.name}", inertia) for other in axes if other is not axis]
    return named


def _baseline(motions: Sequence[AxisMotion], index: int) -> tuple[list[int], Array]:
    """Columns that an axis has in the baseline, and all of them (N, p), unfiltered, zero where they are not its own."""
    motion = motions[index]
    own = [*motion.linear.T, np.sign(motion.velocity), np.ones_like(motion.velocity)]
    own += [other.linear[:, 0] for other in motions if other is not motion]
    raw = np.zeros((len(motion.velocity), len(own) * len(motions)))
    places = list(range(index * len(own), (index + 1) * len(own)))
    raw[:, places] = np.stack(own, axis=1)
    return places, raw


def _regions(motion: AxisMotion, speed: float) -> Mapping[str, Mask]:
    slow = np.abs(motion.velocity) < LOW_SPEED * speed
    middle = np.median(motion.position)
    brisk = np.abs(motion.acceleration) > np.percentile(np.abs(motion.acceleration), 75)
    return {
        "low_speed": slow,
        "forward": ~slow & (motion.velocity > 0),
        "backward": ~slow & (motion.velocity < 0),
        "high_acceleration": brisk,
        "lower_half_of_travel": motion.position < middle,
        "upper_half_of_travel": motion.position >= middle,
    }


def _features(motions: Sequence[AxisMotion]) -> Array:
    series = [values for motion in motions for values in (motion.velocity, motion.position, motion.acceleration)]
    return np.stack(series, axis=1)


def _joined(records: Sequence[list[list[Candidate]]]) -> tuple[Candidate, ...]:
    """Candidates of the same key in several records become one, with columns in the blocks of all."""
    return tuple(
        _across([candidates[axis][index] for candidates in records])
        for axis in range(len(records[0]))
        for index in range(len(records[0][axis]))
    )


def _across(parts: Sequence[Candidate]) -> Candidate:
    first = parts[0]
    variants = tuple(
        Variant(tuple(column for variant in each for column in variant.columns), each[0].start)
        for each in zip(*(part.variants for part in parts), strict=True)
    )

    def contribution(values: Array, baseline: Array) -> tuple[Array | None, ...]:
        series = (part.contribution(values, baseline) for part in parts if part.contribution is not None)
        return tuple(one for each in series for one in each)

    exact = contribution if first.contribution is not None else None
    return Candidate(
        first.effect, first.where, first.parameters, variants, exact, first.drift, first.least, first.negligible
    )

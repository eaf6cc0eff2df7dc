"""From records of axes to a regression with candidates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.axis.candidates import axis_candidates
from ident.diagnosis.axis.dependences import axis_dependences
from ident.diagnosis.axis.model import AxisModel
from ident.diagnosis.axis.motion import AxisMotion, with_repeats
from ident.diagnosis.axis.reference import (
    Reference,
    Scale,
    Signals,
    axis_signals,
    own_columns,
    refuse_other_axes,
)
from ident.diagnosis.delays import HELD
from ident.diagnosis.law.dependence import Dependence, across
from ident.diagnosis.names import EffectName
from ident.diagnosis.problem import Block, Candidate, Channel, Problem, Variant
from ident.diagnosis.refit import Refit
from ident.estimate.axis.identify import PARAMETER_UNITS
from ident.estimate.axis.processing import PARAMETERS
from ident.estimate.filters import SEVEN, differentiate
from ident.records.axis_record import AxisRecord, AxisSignals

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

LOW_SPEED = 0.15
"""Below this part of the usual top speed, a row counts as slow."""
STEP = "motion"
LAG = "lag"
"""Parameter of the baseline: of a motion behind its effort, by sampling."""
SURELY = 2.0
"""Standard deviations by which a lag must exceed what sampling explains."""


def axis_problem(records: Sequence[AxisRecord], reference: Reference) -> Problem:
    """Rows M a + Fv v + Fc sign(v) + offset = effort of every axis of the records, and what might be missing in them.

    With several axes, the acceleration of each stands in the rows of all: inertia couples them, and that is no gap.
    So does, in its own rows, a lag of each axis that sampling can explain.

    Raises:
        RecordError: the records do not have the same axes, or not those of the reference.
        EstimationError: a record is too short, or an axis does not move.
    """
    refuse_other_axes(records)
    signals = [axis_signals(record, reference.cutoff, reference.bandwidth, reference.scales) for record in records]
    parts = [_of_record(one, reference) for one in signals]
    blocks = tuple(block for blocks, _, _ in parts for block in blocks)
    candidates = _joined([candidates for _, candidates, _ in parts])
    dependences = tuple(across(each) for each in zip(*(those for _, _, those in parts), strict=True))
    parameters, units = zip(*_baseline_names(records[0].axes, reference.scales), strict=True)
    return Problem(parameters, units, blocks, candidates, dependences=dependences)


def _of_record(signals: Signals, reference: Reference) -> tuple[list[Block], list[list[Candidate]], list[Dependence]]:
    period = with_repeats(signals.record)
    scales, width = reference.scales, len(PARAMETERS) + len(reference.scales) - 1
    first = np.cumsum([0, *(width + (scale.hold is not None) for scale in scales)]).tolist()
    models = [_model(signals, index, scale, first[index]) for index, scale in enumerate(scales)]
    baselines = _baselines(models, signals, reference.scales)
    blocks = [_block(signals, model, columns, period) for model, columns in zip(models, baselines, strict=True)]
    candidates = [_candidates(model, scale) for model, scale in zip(models, reference.scales, strict=True)]
    return blocks, candidates, [one for model in models for one in axis_dependences(model)]


def delayed_axes(found: Refit, problem: Problem, axes: Sequence[AxisSignals], scales: Sequence[Scale]) -> list[bool]:
    """Which axes follow their effort later than sampling can explain, surely, by the lag in the baseline.

    Args:
        found: refit of the problem.
        problem: whose baseline it is.
        axes, scales: of the problem.
    """
    values = dict(zip(problem.names, zip(found.baseline, found.baseline_std, strict=True), strict=True))
    late = []
    for axis, scale in zip(axes, scales, strict=True):
        lag, std = (0.0, 0.0) if scale.hold is None else values[axis.named(LAG)]
        late.append(abs((scale.hold or 0.0) + lag) - SURELY * std > HELD)
    return late


def _candidates(model: AxisModel, scale: Scale) -> list[Candidate]:
    """Without a delay where the baseline has the lag."""
    return [one for one in axis_candidates(model) if scale.hold is None or one.effect != EffectName.TIME_DELAY]


def _model(signals: Signals, index: int, scale: Scale, first: int) -> AxisModel:
    axis, motion = signals.record.axes[index], signals.motions[index]
    columns = signals.smoothed_columns(index)
    return AxisModel(
        place=axis.named("axis"),
        block=index,
        blocks=len(signals.motions),
        kind=axis.kind,
        motion=motion,
        sample_time=signals.record.sample_time,
        filtered=partial(signals.rows_of, index),
        bandwidth=signals.bandwidth,
        inertia=float(scale.values[0]),
        columns=columns,
        effort=np.asarray(columns @ scale.values),
        first=first,
        absorbed=np.asarray(own_columns(signals.motions, index) @ scale.values),
        speed=scale.speed,
        slowest=scale.slowest,
        reach=scale.reach,
        others=tuple((o.name, m) for o, m in zip(signals.record.axes, signals.motions, strict=True) if m is not motion),
    )


def _block(signals: Signals, model: AxisModel, baseline: Array, period: NDArray[np.int64]) -> Block:
    return Block(
        record=signals.record.source,
        channel=Channel.DYNAMIC,
        step=STEP,
        coordinate=model.place,
        unit=model.kind.effort_unit,
        sample_time=signals.record.sample_time,
        bandwidth=signals.bandwidth,
        target=model.filtered(model.motion.effort),
        baseline=model.filtered(baseline),
        moving=model.motion.moving,
        period=period,
        regions=_regions(model.motion, model.speed),
        features=_features(signals.motions),
    )


def _baseline_names(axes: Sequence[AxisSignals], scales: Sequence[Scale]) -> list[tuple[str, str]]:
    """Name and unit of every parameter of all axes, each axis' own ones behind each other."""
    named = []
    for axis, scale in zip(axes, scales, strict=True):
        inertia = PARAMETER_UNITS[axis.kind]["M"]
        named += [(axis.named(name), PARAMETER_UNITS[axis.kind][name]) for name in PARAMETERS]
        named += [(f"M_{axis.name}_{other.name}", inertia) for other in axes if other is not axis]
        named += [(axis.named(LAG), "samples")] if scale.hold is not None else []
    return named


def _baselines(models: Sequence[AxisModel], signals: Signals, scales: Sequence[Scale]) -> list[Array]:
    """Columns (N, p) of the baseline in the rows of each axis, unfiltered, zero where they are not its own."""
    own = [own_columns(signals.motions, index) for index in range(len(models))]
    for index, (model, scale) in enumerate(zip(models, scales, strict=True)):
        if scale.hold is not None:
            change = model.sample_time * differentiate(model.effort, model.sample_time, SEVEN)
            own[index] = np.column_stack([own[index], change])
    return [
        np.hstack([columns if place == index else np.zeros_like(columns) for place, columns in enumerate(own)])
        for index in range(len(own))
    ]


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
    return replace(first, variants=variants, contribution=exact)

"""From records of axes to a regression with candidates."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.axis.candidates import OF_ACCELERATIONS, axis_candidates
from ident.diagnosis.axis.dependences import axis_dependences
from ident.diagnosis.axis.model import AxisModel
from ident.diagnosis.axis.motion import AxisMotion, with_repeats
from ident.diagnosis.axis.reference import (
    Reference,
    Signals,
    axis_signals,
    own_columns,
    refuse_other_axes,
)
from ident.diagnosis.axis.scale import Scale
from ident.diagnosis.dependence import Dependence, across
from ident.diagnosis.names import EffectName
from ident.diagnosis.problem import Block, Candidate, Channel, Problem, Variant, contributions_of, forces_of, turned_by
from ident.estimate.axis.identify import PARAMETER_UNITS
from ident.estimate.axis.processing import PARAMETERS
from ident.estimate.filters import SEVEN, differentiate
from ident.records.axis_record import AxisRecord, AxisSignals
from ident.records.rates import nominal

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

LOW_SPEED = 0.15
"""Below this part of the usual top speed, a row counts as slow."""
STEP = "motion"
LAG = "lag"
"""Parameter of the baseline: of a motion behind its effort, by sampling."""
HOLD = "hold"
"""Parameter of the baseline: of the second derivative of the effort, by sampling."""
HOLDS = 1 / 12
"""Deviation of that over T²: an effort that is held over the interval acts as one with T²/24 of it less, a position
that is averaged over the interval as one with as much more."""
LAGS = 1 / math.sqrt(12)
"""Deviation of a lag over T: an effort acts half of an interval late, a position is read at any part of one, at each
rate at another."""


def axis_problem(records: Sequence[AxisRecord], reference: Reference) -> Problem:
    """Rows M a + Fv v + Fc sign(v) + offset = effort of every axis of the records, and what might be missing in them.

    With several axes, the acceleration of each stands in the rows of all: inertia couples them, and that is no gap.
    So does, in its own rows, a lag of each axis that sampling can explain, and what holding an effort does to it.

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
    axes = records[0].axes
    parameters, units = zip(*_baseline_names(axes, reference), strict=True)
    of_axes = zip(axes, reference.scales, strict=True)
    known = {name: beforehand for pair in of_axes for name, _, beforehand in _sampling(*pair, reference)}
    return Problem(parameters, units, blocks, candidates, spreads=known, dependences=dependences)


def _sampling(axis: AxisSignals, scale: Scale, reference: Reference) -> Iterator[tuple[str, str, tuple[float, float]]]:
    """What sampling does to an axis, beyond what its efforts have been moved by: name, unit, mean and deviation."""
    yield axis.named(HOLD), "samples^2", (0.0, HOLDS)
    for time in reference.strange:
        yield axis.named(_lag_at(time)), "samples", (scale.hold - scale.hold_at(time), LAGS)
    if not scale.delayed:
        yield axis.named(LAG), "samples", (-scale.hold, LAGS)


def _of_record(signals: Signals, reference: Reference) -> tuple[list[Block], list[list[Candidate]], list[Dependence]]:
    period = with_repeats(signals.record)
    scales, width = reference.scales, len(PARAMETERS) + len(reference.scales) - 1
    sampled = 1 + len(reference.strange)
    first = np.cumsum([0, *(width + sampled + (not scale.delayed) for scale in scales)]).tolist()
    models = [_model(signals, index, scale, first[index]) for index, scale in enumerate(scales)]
    baselines = _baselines(models, signals, reference)
    blocks = [_block(signals, model, columns, period) for model, columns in zip(models, baselines, strict=True)]
    candidates, dependences = [], []
    for model, scale, noise in zip(models, reference.scales, reference.noises, strict=True):
        own = _candidates(model, scale)
        candidates.append([replace(one, noise=noise) if one.effect in OF_ACCELERATIONS else one for one in own])
        dependences += [replace(one, noise=noise) if one.is_noisy else one for one in axis_dependences(model)]
    return blocks, candidates, dependences


def _candidates(model: AxisModel, scale: Scale) -> list[Candidate]:
    """Without a delay where the baseline has the lag."""
    return [one for one in axis_candidates(model) if scale.delayed or one.effect != EffectName.TIME_DELAY]


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
        nearest=scale.nearest,
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


def _lag_at(sample_time: float) -> str:
    """Parameter of the baseline: of a motion behind its effort at a rate of no record to fit, beyond that at theirs."""
    return f"{LAG}_{1 / sample_time:.4g}_Hz"


def _baseline_names(axes: Sequence[AxisSignals], reference: Reference) -> list[tuple[str, str]]:
    """Name and unit of every parameter of all axes, each axis' own ones behind each other."""
    named = []
    for axis, scale in zip(axes, reference.scales, strict=True):
        inertia = PARAMETER_UNITS[axis.kind]["M"]
        named += [(axis.named(name), PARAMETER_UNITS[axis.kind][name]) for name in PARAMETERS]
        named += [(f"M_{axis.name}_{other.name}", inertia) for other in axes if other is not axis]
        named += [(name, unit) for name, unit, _ in _sampling(axis, scale, reference)]
    return named


def _baselines(models: Sequence[AxisModel], signals: Signals, reference: Reference) -> list[Array]:
    """Columns (N, p) of the baseline in the rows of each axis, unfiltered, zero where they are not its own."""
    own = [own_columns(signals.motions, index) for index in range(len(models))]
    for index, (model, scale) in enumerate(zip(models, reference.scales, strict=True)):
        dt = model.sample_time
        change = dt * differentiate(model.effort, dt, SEVEN)
        force = model.inertia * model.motion.acceleration
        sampled = [dt**2 * differentiate(differentiate(force, dt, SEVEN), dt, SEVEN)]
        sampled += [change if nominal(dt) == time else np.zeros_like(change) for time in reference.strange]
        sampled += [] if scale.delayed else [change]
        own[index] = np.column_stack([own[index], *sampled])
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

    exact = None if first.contribution is None else partial(contributions_of, parts)
    force = None if first.force is None else partial(forces_of, parts)
    turned = None if first.turned is None else partial(turned_by, parts)
    return replace(first, variants=variants, contribution=exact, force=force, turned=turned)

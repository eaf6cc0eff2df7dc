"""Faults of a record, from time and counters to single channels, one after the other, each undone before the next."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from threadpoolctl import threadpool_limits

from ident.faults.clock import CERTAIN, missing_numbers, skipped, unit_of_time, unwrapped, without_gaps
from ident.faults.evidence import Evidence
from ident.faults.fault import Fault, FaultName
from ident.faults.hypothesis import Hypothesis
from ident.faults.late import fine_loss, latest
from ident.faults.reduced import reduced
from ident.faults.same import same_as
from ident.faults.search import Scored, least_gain, searched
from ident.faults.stuck import stuck
from ident.records.record import Record, Segment
from ident.vehicle.description import VehicleDescription

MOST: Final = 3
"""Faults of channels that are looked for behind each other."""

RIVALS: Final = 3.0
"""Names within this log likelihood ratio of the best are its set: odds of twenty."""

FACTOR: Final = 1.25
"""Smallest factor of a fault: gains of drives and radii of wheels are off by less, and are effects of the machine."""

DELAY: Final = 0.004
"""Smallest lateness of a fault [s]."""

EFFECT_DELAY: Final = 0.025
"""The same where the library has a delay of the machine: the largest in practice is 0.02 s."""


def find_faults(record: Record, vehicle: VehicleDescription) -> tuple[Fault, ...]:
    """What is wrong with a record, as far as it contradicts itself, the geometry, and the priors of its vehicle.

    Args:
        record: any; its segments need not pass the checks of records.
        vehicle: its geometry is taken as true, its prior within the standard uncertainties.

    Returns:
        Faults, most evident first; empty for a sound record and for what no fault explains.
    """
    with threadpool_limits(limits=1, user_api="blas"):
        return _found(record, vehicle)


def sure_faults(records: Sequence[Record], vehicle: VehicleDescription) -> list[Fault]:
    """Of several records, each fault once: those that make everything fit when undone, or that nothing can undo."""
    found = [fault for record in records for fault in find_faults(record, vehicle) if fault.sure]
    return list({(fault.name, fault.channel, fault.step): fault for fault in found}.values())


def _found(record: Record, vehicle: VehicleDescription) -> tuple[Fault, ...]:
    segments, faults = _by_themselves(list(record.segments))
    pairs = reduced(segments)
    if any(np.ptp(segment.wheel_angles) > 0 for segment, _ in pairs):
        faults += _of_channels(pairs, vehicle)
    return tuple(sorted(faults, key=lambda fault: -fault.evidence))


def _of_channels(pairs: Sequence[tuple[Segment, Segment]], vehicle: VehicleDescription) -> list[Fault]:
    """Channels that contradict each other; one that stands still contradicts the others whatever they are called."""
    contradicting, fits = _between_channels(Evidence([smooth for _, smooth in pairs], vehicle))
    standing = stuck(pairs, vehicle)
    # Of a channel that stands still any factor makes as good as nothing, and nothing contradicts nothing.
    vanished = {fault.channel for fault in contradicting if fault.name is FaultName.SCALED}
    if contradicting and fits and not vanished & {fault.channel for fault in standing}:
        return contradicting
    return standing or contradicting


def _by_themselves(segments: list[Segment]) -> tuple[list[Segment], list[Fault]]:
    """Faults that a segment shows without any model, undone."""
    faults: list[Fault] = []
    unit = unit_of_time([replace(each, sample_time=_interval(each)) for each in segments])
    if unit != 1.0:
        faults.append(Fault(FaultName.SCALED, "time", unit, "1", 0.0, CERTAIN, True))
    segments = [
        replace(each, time=each.time / unit, sample_time=_interval(each) / unit) for each in segments if len(each) > 2
    ]
    steps: tuple[Callable[[Segment], tuple[Segment, list[Fault]]], ...] = (missing_numbers, without_gaps)
    for step in steps:
        segments, found = _each(step, segments)
        faults += found
    segments, found = unwrapped(segments)
    faults += found
    segments, found = _each(skipped, segments)
    return segments, faults + found


def _interval(segment: Segment) -> float:
    return float(np.median(np.diff(segment.time))) if len(segment) > 2 else segment.sample_time


def _each(
    step: Callable[[Segment], tuple[Segment, list[Fault]]], segments: Sequence[Segment]
) -> tuple[list[Segment], list[Fault]]:
    pairs = [step(segment) for segment in segments]
    return [segment for segment, _ in pairs], [fault for _, faults in pairs for fault in faults]


def _between_channels(evidence: Evidence) -> tuple[list[Fault], bool]:
    """Faults in which channels contradict each other, the most evident undone before the next; and if that fits."""
    faults: list[Fault] = []
    for _ in range(MOST):
        found = _most_evident(evidence)
        if found is None:
            break
        hypothesis, gain, others = found
        evidence = evidence.without(hypothesis)
        # What a machine may have by itself is undone too, or something else would be named for it.
        if _is_fault(hypothesis):
            also = [*same_as(hypothesis), *(other.key for other in others)]
            faults.append(hypothesis.fault(gain, False, also))
    fits = evidence.fits
    return [replace(fault, undo_fits=fits) for fault in faults], fits


def _most_evident(evidence: Evidence) -> tuple[Hypothesis, float, list[Hypothesis]] | None:
    gross = searched(evidence)
    if gross and evidence.loss - gross[0].loss > least_gain(evidence):
        return _with_rivals(gross, evidence.loss)
    late = latest(evidence)
    return _with_rivals(late, fine_loss(evidence)) if late else None


def _with_rivals(scored: Sequence[Scored], base: float) -> tuple[Hypothesis, float, list[Hypothesis]]:
    near = [each for each in scored if each.loss < scored[0].loss + RIVALS]
    near.sort(key=lambda each: (round(each.loss - scored[0].loss, 1), _width(each.hypothesis)))
    best = near[0].hypothesis
    others = {each.hypothesis.key: each.hypothesis for each in near[1:] if each.hypothesis.key != best.key}
    return best, base - near[0].loss, list(others.values())


def _width(hypothesis: Hypothesis) -> int:
    """Channels that a hypothesis needs; of names that are the same here the narrower comes first."""
    return len(hypothesis.place.columns) if hypothesis.place is not None else 0


def _is_fault(hypothesis: Hypothesis) -> bool:
    """Whether it is larger than what a sound machine has by itself."""
    if hypothesis.name is FaultName.SCALED:
        return not 1 / FACTOR <= hypothesis.value <= FACTOR
    if hypothesis.name is FaultName.LATE:
        return abs(hypothesis.value) > (EFFECT_DELAY if same_as(hypothesis) else DELAY)
    return True

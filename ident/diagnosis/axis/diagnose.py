"""The diagnosis of a servo axis, or of several coupled ones, from their records."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace

from threadpoolctl import threadpool_limits

from ident.diagnosis.answer.findings import Findings
from ident.diagnosis.answer.judge import judge
from ident.diagnosis.axis.problem import axis_problem, delayed_axes
from ident.diagnosis.axis.reference import Reference, axis_reference, refuse_other_axes
from ident.diagnosis.axis.scale import Scale
from ident.diagnosis.names import LATE
from ident.diagnosis.observations.split import split_problem
from ident.diagnosis.problem import Problem
from ident.records.axis_record import AxisRecord, AxisSignals
from ident.stages import Stage, untold


def diagnose_axis(
    fit: Sequence[AxisRecord],
    confirm: Sequence[AxisRecord],
    *,
    seed: int,
    cutoff: float | None = None,
    lacking: Collection[str] = (),
    stage: Stage = untold,
) -> Findings:
    """What the model M a + Fv v + Fc sign(v) + offset lacks.

    Args:
        fit: records that causes are looked for in.
        confirm: independent records of the same axes; none: a part of `fit` confirms.
        seed: of the smooth function of what is left.
        cutoff: of the position filter [rad/s]; None: chosen from the records.
        lacking: names of effects that are not looked for.
        stage: told what begins.

    Raises:
        RecordError: the records do not have the same axes.
        EstimationError: a record is too short, or an axis does not move.
    """
    # Tall, thin matrices: more threads of the linear algebra library only wait for each other.
    with threadpool_limits(limits=1, user_api="blas"):
        return _diagnosed(fit, confirm, seed, cutoff, lacking, stage)


def _diagnosed(
    fit: Sequence[AxisRecord],
    confirm: Sequence[AxisRecord],
    seed: int,
    cutoff: float | None,
    lacking: Collection[str],
    stage: Stage,
) -> Findings:
    refuse_other_axes([*fit, *confirm])
    stage("filter of the records")
    reference = axis_reference(fit, cutoff, confirm)

    def found_by(reference: Reference) -> Findings:
        return judge(*pose_axis(fit, confirm, reference, lacking), seed=seed, stage=stage)

    findings = found_by(reference)
    scales = tuple(_on_second_thought(reference.scales, findings, fit[0].axes))
    if all(scale is before for scale, before in zip(scales, reference.scales, strict=True)):
        return findings
    stage("again, an axis being late, or not")
    return found_by(replace(reference, scales=scales))


def pose_axis(
    fit: Sequence[AxisRecord], confirm: Sequence[AxisRecord], reference: Reference, lacking: Collection[str] = ()
) -> tuple[Problem, Problem]:
    """The rows of records to fit and to confirm, and the candidates; arguments of `diagnose_axis`."""
    fitted = _without(axis_problem(fit, reference), lacking)
    return (fitted, _without(axis_problem(confirm, reference), lacking)) if confirm else split_problem(fitted)


def _on_second_thought(scales: Sequence[Scale], findings: Findings, axes: Sequence[AxisSignals]) -> Iterator[Scale]:
    """Scales without a hold where the lag is a delay, and with one where a seeming delay was something else."""
    named = {cause.candidate.where for cause in findings.causes if cause.candidate.effect in LATE}
    late = delayed_axes(findings.after, findings.problem, axes, scales)
    for scale, axis, delayed in zip(scales, axes, late, strict=True):
        if delayed:
            yield replace(scale, hold=None)
        elif scale.hold is None and axis.named("axis") not in named:
            yield replace(scale, hold=0.0)
        else:
            yield scale


def _without(problem: Problem, names: Collection[str]) -> Problem:
    return replace(problem, candidates=tuple(one for one in problem.candidates if one.effect not in names))

"""The diagnosis of a servo axis, or of several coupled ones, from their records."""

from __future__ import annotations

import operator
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

from threadpoolctl import threadpool_limits

from ident.diagnosis.answer.findings import Findings
from ident.diagnosis.answer.judge import Answers, Names, answers_of
from ident.diagnosis.axis.late import delayed_scales, likelier_scales
from ident.diagnosis.axis.problem import axis_problem
from ident.diagnosis.axis.reference import Reference, axis_reference, refuse_other_axes
from ident.diagnosis.observations.split import split_problem
from ident.diagnosis.problem import Problem
from ident.records.axis_record import AxisRecord
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

    def found_by(reference: Reference, known: Mapping[Names, Findings] | None = None) -> Answers:
        return answers_of(*pose_axis(fit, confirm, reference, lacking), seed=seed, known=known, stage=stage)

    answers = found_by(reference)
    findings = answers.findings()
    late = delayed_scales(findings, fit[0], reference.scales)
    if late is None:
        return findings
    stage("again, an axis being late")
    # An axis that is late has no lag among its parameters: names tell which pieces are as they were.
    again = found_by(replace(reference, scales=late), answers.by_names)
    scales = tuple(likelier_scales(answers, again, fit[0].axes, reference, late))
    for asked, by in ((again, late), (answers, reference.scales)):
        if all(map(operator.is_, scales, by)):
            return asked.findings()
    return found_by(replace(reference, scales=scales), answers.by_names | again.by_names).findings()


def pose_axis(
    fit: Sequence[AxisRecord], confirm: Sequence[AxisRecord], reference: Reference, lacking: Collection[str] = ()
) -> tuple[Problem, Problem]:
    """The rows of records to fit and to confirm, and the candidates; arguments of `diagnose_axis`."""
    fitted = _without(axis_problem(fit, reference), lacking)
    return (fitted, _without(axis_problem(confirm, reference), lacking)) if confirm else split_problem(fitted)


def _without(problem: Problem, names: Collection[str]) -> Problem:
    return replace(problem, candidates=tuple(one for one in problem.candidates if one.effect not in names))

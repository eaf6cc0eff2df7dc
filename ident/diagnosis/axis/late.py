"""Whether an axis is later than sampling makes it, so that a delay is a cause and how late it is no parameter."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from ident.diagnosis.answer.findings import Cause, Findings
from ident.diagnosis.answer.judge import Answers
from ident.diagnosis.axis.problem import LAG
from ident.diagnosis.axis.reference import Reference
from ident.diagnosis.axis.scale import Scale
from ident.diagnosis.check.sized import SURELY
from ident.diagnosis.dependence import Variable
from ident.diagnosis.names import LATE
from ident.diagnosis.observations.delays import HELD
from ident.estimate.axis.processing import PARAMETERS
from ident.records.axis_record import AxisRecord, AxisSignals


def delayed_scales(findings: Findings, record: AxisRecord, scales: Sequence[Scale]) -> tuple[Scale, ...] | None:
    """Scales, delayed where an axis is surely later than sampling makes it, or has a cause that acts as a delay does.

    Args:
        findings: with the lag of every axis in the baseline.
        record: one of those to fit.
        scales: of its axes.

    Returns:
        None where no axis is.
    """
    late = {cause.candidate.where for cause in findings.causes if _acts_late(cause)}
    numbers = zip(findings.after.baseline.tolist(), findings.after.baseline_std.tolist(), strict=True)
    values = dict(zip(findings.problem.names, numbers, strict=True))

    def one(axis: AxisSignals, scale: Scale) -> Scale:
        value, std = values[axis.named(LAG)]
        lag = scale.hold + value
        if abs(lag) - SURELY * std <= HELD and axis.named("axis") not in late:
            return scale
        return replace(scale, hold=0.0, late=lag * record.sample_time, delayed=True)

    found = tuple(one(*pair) for pair in zip(record.axes, scales, strict=True))
    return found if any(scale.delayed for scale in found) else None


def likelier_scales(
    before: Answers, after: Answers, axes: Sequence[AxisSignals], reference: Reference, late: Sequence[Scale]
) -> Iterator[Scale]:
    """Scales of the likelier answers: a delay is not taken for the noise of an acceleration, nor is a lag.

    Args:
        before: answers by the scales of the reference.
        after: those by the others.
        axes: of a record.
        reference: of the records.
        late: the other scales.
    """
    for axis, noise, own, other in zip(axes, reference.noises, reference.scales, late, strict=True):
        lag, delay = (answers.of(axis.named(PARAMETERS[0])).log_posterior for answers in (before, after))
        yield other if delay > lag - noise else own


def _acts_late(cause: Cause) -> bool:
    law = cause.law
    return cause.candidate.effect in LATE if law is None else law.dependence.variable is Variable.LOAD_RATE

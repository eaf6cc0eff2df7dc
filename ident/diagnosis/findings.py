"""What a diagnosis has found, and the answer that this makes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.diagnosis import Diagnosis, Gap, NamedEffect, Share, Verdict
from ident.diagnosis.generic import Generic
from ident.diagnosis.law.answer import Alternative, LawAnswer
from ident.diagnosis.law.free import Curve
from ident.diagnosis.law.stage import Law
from ident.diagnosis.probability import Ranked, calibration
from ident.diagnosis.problem import Candidate, Problem
from ident.diagnosis.refit import Part, Refit
from ident.vehicle.quantities import Quantity

Array = NDArray[np.float64]

LAW: Final = "law"
"""Name of a cause that has none."""


@dataclass(frozen=True)
class Cause:
    """An effect that was found.

    Attributes:
        candidate: what and where.
        part: its parameters, all records fitted.
        ranked: what else may stand in its place.
        probability: that its name is right, or one that is the same in these records.
        log_evidence, log_predictive: of all records, and what the confirming rows add.
        closed: share of the removable held-out gap that it closes, others given, the values of a judged model held; not
            negative where that gap is within the accidents of its noise.
        needed: the same with everything else refitted without it.
        biased: how much each parameter of the model shifts when the effect is left out, by name, in standard
            deviations.
        curve: whether it fits the curve of its variable as well as a free function does.
        sizeless: it may be of no size itself, and what comes along with it is the explanation.
        law: as it was learnt, of a law without a name.
        law_answer: as it is written down.
        alternatives: what adds the same to these records.
    """

    candidate: Candidate
    part: Part
    ranked: Ranked
    probability: float
    log_evidence: float
    log_predictive: float
    closed: float
    needed: float
    biased: Mapping[str, float]
    curve: Curve
    sizeless: bool
    law: Law | None = None
    law_answer: LawAnswer | None = None
    alternatives: tuple[Alternative, ...] = ()

    @property
    def quantities(self) -> Mapping[str, Quantity]:
        """Its parameters with units and standard deviations, by name."""
        numbers = zip(self.candidate.parameters, self.part.values, self.part.std, strict=True)
        return {p.name: Quantity(float(value), p.unit, "diagnosis", float(std)) for p, value, std in numbers}


@dataclass(frozen=True)
class HeldOut:
    """What was fitted without the confirming rows, and the problem that they come from.

    Attributes:
        problem: that confirms.
        plain, extended: refits without and with the causes.
        before, after: models (N,) of every block of `problem`; before is the model that was given, or that refit.
    """

    problem: Problem
    plain: Refit
    extended: Refit
    before: tuple[Array, ...]
    after: tuple[Array, ...]


@dataclass(frozen=True)
class Findings:
    """Everything that was found.

    Attributes:
        verdict: of the search and of what is left.
        causes: most probable first.
        doubtful: what came out best beside the causes and was not believed, with its probability, best first.
        events: what one drive shows clearly and the other does not, best first: no cause.
        gap: held out.
        where: shares of the gap.
        invisible: names of effects that are nowhere visible.
        before, after: of all rows without and with the causes; before is the model that was given, or a refit.
        significance: that the best candidate is there by chance.
        remainder: what a smooth function still predicts.
        lasting: whether something repeats in every record, above its limit, that the effects leave.
        repeated_before, repeated_after: rms over noise of what repeats, by step and coordinate.
        problem: that was fitted.
        held_out: models that the confirming rows took no part in.
    """

    verdict: Verdict
    causes: tuple[Cause, ...]
    doubtful: Mapping[str, float]
    events: tuple[str, ...]
    gap: Gap
    where: tuple[Share, ...]
    invisible: tuple[str, ...]
    before: Refit
    after: Refit
    significance: float
    remainder: Generic
    lasting: bool
    repeated_before: Mapping[str, float]
    repeated_after: Mapping[str, float]
    problem: Problem
    held_out: HeldOut

    def diagnosis(self, next_experiment: str | None = None) -> Diagnosis:
        """The answer as it is written down."""
        coverage = calibration().coverage
        return Diagnosis(
            verdict=self.verdict,
            effects=tuple(_named(cause, coverage) for cause in self.causes) if self.verdict.explains else (),
            where=self.where,
            gap=self.gap,
            invisible=self.invisible,
            next_experiment=next_experiment,
        )


def _ambiguity_set(cause: Cause, coverage: float) -> tuple[str, ...]:
    """Names that the records do not tell apart, and a law among them where a free function does as well or better."""
    if cause.law is not None:
        return (LAW,)
    names = cause.ranked.ambiguity_set(str(cause.candidate.effect), coverage)
    return names if cause.curve is Curve.ITS_OWN else (*names, LAW)


def _named(cause: Cause, coverage: float) -> NamedEffect:
    name = LAW if cause.law is not None else str(cause.candidate.effect)
    return NamedEffect(
        name=name,
        where=cause.candidate.where,
        parameters=cause.quantities,
        probability=round(cause.probability, 2),
        ambiguity_set=_ambiguity_set(cause, coverage),
        gap_closed_held_out=cause.closed,
        alternatives=cause.alternatives,
        law=cause.law_answer,
    )


def ordered(causes: Sequence[Cause]) -> tuple[Cause, ...]:
    """By the share of the held-out gap that needs them, to a half, then by evidence; none surer than those before it.

    What is found beside another cause is right only as far as that one is.
    """
    found: list[Cause] = []
    for cause in sorted(causes, key=lambda cause: (-round(2 * cause.needed), -cause.log_evidence)):
        surest = min([cause.probability, *(other.probability for other in found[-1:])])
        found.append(replace(cause, probability=surest))
    return tuple(found)

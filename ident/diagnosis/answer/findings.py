"""What a diagnosis has found, and the answer that this makes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.check.fitted import HeldOut
from ident.diagnosis.check.generic import Generic
from ident.diagnosis.check.refit import Part, Refit
from ident.diagnosis.diagnosis import Alternative, Diagnosis, Gap, LawAnswer, NamedEffect, Share, Verdict
from ident.diagnosis.law.law import Law
from ident.diagnosis.names import LAW
from ident.diagnosis.problem import Candidate, Problem
from ident.diagnosis.search.ranked import Ranked
from ident.vehicle.quantities import Quantity

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Cause:
    """An effect that was found.

    Attributes:
        candidate: what and where.
        part: its parameters, all records fitted.
        ranked: what else may stand in its place.
        probability: that its name is right, or one that is the same in these records.
        log_odds: that it is there against nothing in its place.
        closed: share of the removable held-out gap that it closes, others given, the values of a judged model held; not
            negative where that gap is within the accidents of its noise.
        needed: the same with everything else refitted without it.
        biased: how much each parameter of the model shifts when the effect is left out, by name, in standard
            deviations.
        law: as it was learnt, of a law without a name.
        law_answer: as it is written down.
        alternatives: what adds the same to these records, and where else it may be.
    """

    candidate: Candidate
    part: Part
    ranked: Ranked
    probability: float
    log_odds: float
    closed: float
    needed: float
    biased: Mapping[str, float]
    law: Law | None = None
    law_answer: LawAnswer | None = None
    alternatives: tuple[Alternative, ...] = ()

    @property
    def quantities(self) -> Mapping[str, Quantity]:
        """Its parameters with units and standard deviations, by name."""
        numbers = zip(self.candidate.parameters, self.part.values, self.part.std, strict=True)
        return {p.name: Quantity(float(value), p.unit, "diagnosis", float(std)) for p, value, std in numbers}


@dataclass(frozen=True)
class Findings:
    """Everything that was found.

    Attributes:
        verdict: what kind of answer the causes are, and what they leave.
        causes: most probable first.
        doubtful: what came out best beside the causes and was not believed, with its probability, best first.
        gap: held out.
        where: shares of the gap.
        invisible: names of effects that are nowhere visible.
        before, after: of all rows without and with the causes; before is the model that was given, or a refit.
        nothing: largest probability of nothing in the place of a cause; None without causes.
        remainder: what a smooth function still predicts.
        lacking: whether more is lacking somewhere than noise and tolerance that are not known exactly.
        repeated_before, repeated_after: rms over noise of what repeats, by step and coordinate.
        problem: that was fitted.
        held_out: models that the confirming rows took no part in.
        log_posterior: of the causes, found or not believed at last, but for a constant of the rows.
    """

    verdict: Verdict
    causes: tuple[Cause, ...]
    doubtful: Mapping[str, float]
    gap: Gap
    where: tuple[Share, ...]
    invisible: tuple[str, ...]
    before: Refit
    after: Refit
    nothing: float | None
    remainder: Generic
    lacking: bool
    repeated_before: Mapping[str, float]
    repeated_after: Mapping[str, float]
    problem: Problem
    held_out: HeldOut
    log_posterior: float

    def diagnosis(self, next_experiment: str | None = None) -> Diagnosis:
        """The answer as it is written down."""
        return Diagnosis(
            verdict=self.verdict,
            effects=tuple(_named(cause) for cause in self.causes) if self.verdict.explains else (),
            where=self.where,
            gap=self.gap,
            invisible=self.invisible,
            next_experiment=next_experiment,
        )


def _named(cause: Cause) -> NamedEffect:
    name = LAW if cause.law is not None else str(cause.candidate.effect)
    return NamedEffect(
        name=name,
        where=cause.candidate.where,
        parameters=cause.quantities,
        probability=round(cause.probability, 2),
        ambiguity_set=(LAW,) if cause.law is not None else cause.ranked.ambiguity_set(name),
        gap_closed_held_out=cause.closed,
        alternatives=cause.alternatives,
        law=cause.law_answer,
    )


def by_need(causes: Sequence[Cause]) -> list[Cause]:
    """By the share of the held-out gap that needs them, to a half, then by evidence."""
    return sorted(causes, key=lambda cause: (-round(2 * cause.needed), -cause.log_odds))


def ordered(causes: Sequence[Cause]) -> tuple[Cause, ...]:
    """By the share of the held-out gap that needs them, to a half, then by evidence; none surer than those before it.

    What is found beside another cause is right only as far as that one is.
    """
    found: list[Cause] = []
    for cause in by_need(causes):
        surest = min([cause.probability, *(other.probability for other in found[-1:])])
        found.append(replace(cause, probability=surest))
    return tuple(found)

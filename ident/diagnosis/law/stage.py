"""The search for a law: on what does the remainder depend, beside what is taken?

Every dependence is learnt beside the baseline and the effects taken. First noise has a level alone, so that a law of
long memory is not taken for its colour; then the colour of what the best law leaves, and all are learnt again. A law
must explain more than coloured noise without a law does: that noise is as free to remember as the law is.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.functions import function_of
from ident.diagnosis.law.dependence import Dependence
from ident.diagnosis.law.learning import Designs, Learner, Learnt
from ident.diagnosis.problem import Candidate, Problem, Variant
from ident.diagnosis.regression import Regression
from ident.diagnosis.rows import Column
from ident.diagnosis.whitening import ORDER
from ident.effects import EffectParameter

Array = NDArray[np.float64]

SCALE: Final = EffectParameter("scale", "1", "of the law as it was learnt")
"""The one number that a law has in a refit."""

SAME: Final = 0.98
"""Cosine of what two laws add to the rows, above which these records do not tell them apart."""

ROUNDS: Final = 3
"""Of learning all dependences: with levels alone, with the colour of what the best law leaves, and with its colour."""

SURELY: Final = 3.0
"""Log odds that a law, all that were tried shared among, must have, and log evidence of the rows of either record."""


@dataclass(frozen=True)
class Law:
    """A law that was found, and what else it may be.

    Attributes:
        dependence: on what, and where.
        learnt: its function.
        odds: log odds of every dependence by key, against no law.
        same: keys of those that add the same to these rows, best first.
        number: of its candidate.
    """

    dependence: Dependence
    learnt: Learnt
    odds: Mapping[str, float]
    same: tuple[str, ...]
    number: int

    def probability(self, temperature: float) -> float:
        """That it is this law, or one that adds the same to these rows.

        Args:
            temperature: by which log evidence is divided.
        """
        scaled = {key: value / temperature for key, value in self.odds.items()}
        largest = max(0.0, *scaled.values())
        weights = {key: math.exp(value - largest) for key, value in scaled.items()}
        nothing = len(weights) * math.exp(-largest)
        return sum(weights[key] for key in self.same) / (sum(weights.values()) + nothing)


def next_law(problems: Sequence[Problem], regression: Regression, designs: Designs, taken: Sequence[int]) -> Law | None:
    """The law that explains most beside what is taken; None where none does surely."""
    dependences = problems[0].dependences
    columns = regression.columns_of(tuple(taken))
    tried, order = range(len(dependences)), 0
    beside = columns
    for _ in range(ROUNDS):
        whitener = regression.colour_beside(beside, order)
        learner = Learner(regression, whitener, taken)
        made = [one for index in tried if (one := _tried(learner, designs, index)) is not None]
        found = sorted(made, key=lambda one: -one.total(0.0))
        if not found:
            return None
        beside, order = np.column_stack([columns, designs.columns(found[0].index) @ found[0].whole]), ORDER
    best_one = found[0]
    coloured = regression.log_likelihood(columns, regression.colour_beside(columns))
    cost = max(coloured - regression.log_likelihood(columns, whitener), 0.0)
    seen_in_both = min(best_one.log_evidence, best_one.log_predictive) > SURELY
    if best_one.total(cost) < SURELY + math.log(len(dependences)) or not seen_in_both:
        return None
    same = tuple(dependences[one.index].key for one in found if cosine(one.shape, best_one.shape) > SAME)
    odds = {dependences[one.index].key: one.total(cost) for one in found}
    return Law(dependences[best_one.index], best_one, odds, same, len(problems[0].candidates))


def with_law(
    problems: Sequence[Problem], regression: Regression, law: Law
) -> tuple[tuple[Problem, ...], Regression, int]:
    """The problems and their rows with the law as one more candidate, and the number of its variant."""
    changed: list[Problem] = []
    series: list[Array | None] = []
    for problem in problems:
        design = problem.dependences[law.learnt.index].design(law.learnt.knots.basis)
        columns = tuple(None if one is None else (one @ law.learnt.weights)[:, None] for one in design)
        series += columns
        variants = (Variant(columns),)
        candidate = Candidate(law.dependence.effect, law.dependence.where, (SCALE,), variants, least=0.0, learnt=True)
        changed.append(replace(problem, candidates=(*problem.candidates, candidate)))
    rows = regression.rows
    end = rows.columns.shape[1]
    column = Column(law.number, 0, slice(end, end + 1), 0.0, (0.0, 0.0))
    wider = replace(rows, columns=np.hstack([rows.columns, rows.stack(series, 1)]), layout=(*rows.layout, column))
    return tuple(changed), Regression(changed[0], wider, regression.settings, regression.seed), len(rows.layout)


def is_of_its_kind(candidate: Candidate, law: Law) -> bool:
    """Whether a named candidate is a function of what a law is one of: it may stand in its place, but not beside it."""
    there = candidate.where == law.dependence.where
    return there and function_of(candidate.effect) == (law.dependence.variable, law.dependence.partner)


def _tried(learner: Learner, designs: Designs, index: int) -> Learnt | None:
    knots = designs.knots(index)
    return None if knots is None else learner.learn(index, designs.columns(index), knots)


def cosine(one: Array, other: Array) -> float:
    """Of the angle between two lines, without a sign; 0 where one has no direction."""
    lengths = float(np.linalg.norm(one) * np.linalg.norm(other))
    return abs(float(one @ other)) / lengths if lengths > 0 else 0.0

"""Members of a set as variants of candidates, for the exact refit; laws become candidates of their own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.evidence.state import State
from ident.diagnosis.hypotheses.hypotheses import Design
from ident.diagnosis.law.law import Law, with_law
from ident.diagnosis.law.learning import Designs, Learner
from ident.diagnosis.observations.regression import Regression
from ident.diagnosis.observations.rows import Column
from ident.diagnosis.problem import Problem
from ident.diagnosis.search.slots import Slot

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TakenMembers:
    """Members as variants of candidates, laws among them.

    Attributes:
        problems, regression: with a candidate for every law.
        variants: by hypothesis.
        laws: by hypothesis.
    """

    problems: tuple[Problem, ...]
    regression: Regression
    variants: Mapping[int, int]
    laws: Mapping[int, Law]


def as_variants(
    problems: tuple[Problem, ...],
    regression: Regression,
    designs: Designs,
    design: Design,
    state: State,
    slots: Mapping[int, Slot],
) -> TakenMembers:
    """Members as variants of candidates; a law that the fitted rows do not show by themselves is none."""
    variants, laws, rows = dict[int, int](), dict[int, Law](), regression.rows
    for index, member in state.members.items():
        column = design.hypotheses[index].blocks[member.block].column
        if column is not None:
            variants[index] = rows.layout.index(column)
        if column is not None and index in state.bends:
            problems = tuple(_started(problem, column, state.bends[index].numbers) for problem in problems)
    for index in [one for one in state.members if design.hypotheses[one].free]:
        law = _law(problems, regression, designs, design, state, slots[index].excess, index, tuple(variants.values()))
        if law is not None:
            problems, regression, variants[index] = with_law(problems, regression, law)
            laws[index] = law
    kept = {index: variants[index] for index in state.members if index in variants}
    return TakenMembers(problems, regression, kept, laws)


def _started(problem: Problem, column: Column, numbers: Array) -> Problem:
    """A problem in which the exact refit of a variant may begin with the numbers (m,) that were found."""
    candidate = problem.candidates[column.candidate]
    variants = list(candidate.variants)
    variants[column.variant] = replace(variants[column.variant], found=numbers)
    candidates = list(problem.candidates)
    candidates[column.candidate] = replace(candidate, variants=tuple(variants))
    return replace(problem, candidates=tuple(candidates))


def _law(
    problems: Sequence[Problem],
    regression: Regression,
    designs: Designs,
    design: Design,
    state: State,
    excess: float,
    index: int,
    others: tuple[int, ...],
) -> Law | None:
    number = design.hypotheses[index].dependence
    assert number is not None
    knots = designs.knots(number)
    assert knots is not None
    learner = Learner(regression, state.evidence.noise, others)
    learnt = learner.learn(designs.columns(number), knots, excess)
    if learnt is None:
        return None
    return Law(problems[0].dependences[number], number, learnt, len(problems[0].candidates))

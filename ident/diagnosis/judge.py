"""From two problems to an answer: search, judgement, and both again without what that refutes."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace
from typing import Final, Protocol

import numpy as np

from ident.diagnosis.findings import Findings
from ident.diagnosis.judgement import Judgement
from ident.diagnosis.late_orders import with_late_orders
from ident.diagnosis.law.drift import repeats, time_law, without_drift, without_time
from ident.diagnosis.law.learning import Designs
from ident.diagnosis.law.stage import Law, is_of_its_kind, next_law, with_law
from ident.diagnosis.limits import Limits
from ident.diagnosis.orders import with_orders
from ident.diagnosis.problem import Problem
from ident.diagnosis.regression import Regression
from ident.diagnosis.rows import make_rows
from ident.diagnosis.search import concluded
from ident.diagnosis.settings import Settings
from ident.diagnosis.shapes import Shaped, search
from ident.diagnosis.symmetry import most_symmetric
from ident.stages import Stage, untold

MOST_LAWS: Final = 2
"""Of which an answer consists; more would be a black box."""


class Judge(Protocol):
    """What finds the causes of a gap."""

    def __call__(self, fit: Problem, confirm: Problem, *, seed: int, stage: Stage) -> Findings:
        """The causes, by records to fit and to confirm."""


def judge(
    fit: Problem,
    confirm: Problem,
    *,
    seed: int,
    settings: Settings | None = None,
    limits: Limits | None = None,
    stage: Stage = untold,
) -> Findings:
    """Find the causes of a gap.

    Tall, thin matrices: callers keep the linear algebra library to one thread.

    Args:
        fit: records that effects are looked for in.
        confirm: independent records, or a part of the same ones that took no part (`split_problem`).
        seed: of the surrogates and of the smooth function.
        settings, limits: thresholds.
        stage: told what begins.
    """
    settings, limits = settings or Settings(), limits or Limits()
    fit, confirm = with_orders((fit, confirm))
    if not repeats((fit, confirm)):
        return _unrefuted((fit, confirm), seed, settings, limits, stage).findings()
    stage("what follows time")
    drift = time_law((fit, confirm), settings, seed)
    averaged = [replace(problem, dependences=without_time(problem)) for problem in (fit, confirm)]
    if drift is not None:
        problems = (without_drift(fit, drift), without_drift(confirm, drift))
        judgement = _unrefuted(problems, seed, settings, limits, stage)
        if judgement.fitted.closed_by_drift > limits.law:
            return judgement.findings(drift)
    return _unrefuted((averaged[0], averaged[1]), seed, settings, limits, stage).findings()


def _unrefuted(
    problems: tuple[Problem, Problem], seed: int, settings: Settings, limits: Limits, stage: Stage
) -> Judgement:
    """Judged again and again without the candidates that the records speak against."""
    fit, confirm = problems
    judgement = _judged_once((fit, confirm), seed, settings, limits, stage)
    while refuted := judgement.refuted():
        stage(f"again without {', '.join(sorted(refuted))}")
        fit, confirm = (_without(problem, refuted) for problem in (fit, confirm))
        judgement = _judged_once((fit, confirm), seed, settings, limits, stage)
    stage("numbers of the answer")
    return judgement


def _judged_once(
    problems: tuple[Problem, Problem], seed: int, settings: Settings, limits: Limits, stage: Stage
) -> Judgement:
    stage(f"searching {len(problems[0].candidates)} candidates")
    regression = Regression(problems[0], make_rows(*problems), settings, seed)
    searched = most_symmetric(with_late_orders(search(problems, regression)))
    stage(f"fitting {len(searched.taken)} causes")

    def concluded_from(found: Shaped, laws: tuple[Law, ...] = ()) -> Judgement:
        return _judged(found, laws, limits, seed)

    judgement = concluded_from(searched)
    # One law may do what several names do together.
    if not problems[0].dependences or (len(judgement.found.variants) == 1 and not judgement.incomplete()):
        return judgement
    stage(f"on what the remainder depends: {len(problems[0].dependences)} possibilities")
    designs = Designs(problems, regression.rows)
    starts = [searched, *([Shaped(problems, regression, ())] if searched.taken else [])]
    found = [one for start in starts if (one := _with_laws(start, designs, concluded_from)) is not None]
    if not judgement.found.variants:
        # A law has its evidence against nothing at all, as a name has: of a small cause the gap says too little.
        return next((one for one in found if one.has_law), judgement)
    found = [judgement, *found]
    floors = np.min([one.fitted.floors for one in found], axis=0)
    acting = frozenset[str]().union(*(one.fitted.reached for one in found))
    masks = [one.fitted.told for one in found if one.fitted.told]
    told = tuple(np.logical_and.reduce(each) for each in zip(*masks, strict=True))
    return min(found, key=lambda one: one.cost(floors, acting, told))


def _judged(searched: Shaped, laws: tuple[Law, ...], limits: Limits, seed: int) -> Judgement:
    """Of causes that were found, without those that the confirming records speak against."""
    found = concluded(searched.regression, searched.taken)
    judgement = Judgement(searched.problems, searched.regression, found, limits, seed, laws)
    while (kept := judgement.worthwhile()) != found.variants:
        found = concluded(searched.regression, kept)
        judgement = Judgement(searched.problems, searched.regression, found, limits, seed, laws)
    return judgement


def _with_laws(
    start: Shaped, designs: Designs, judged: Callable[[Shaped, tuple[Law, ...]], Judgement]
) -> Judgement | None:
    """Laws beside what is taken, one after the other, and names beside those; None where none is found."""
    found, judgement = start, None
    laws: tuple[Law, ...] = ()
    for _ in range(MOST_LAWS):
        law = next_law(found.problems, found.regression, designs, found.taken)
        # What a name of the same kind leaves is no law: without that name the law is all of it.
        if law is None or _of_its_kind(law, found):
            break
        laws = (*laws, law)
        problems, regression, variant = with_law(found.problems, found.regression, law)
        found = most_symmetric(search(problems, regression, (*found.taken, variant)))
        if any(found.regression.owners[one] == law.number for one in found.taken):
            others = _of_its_kind(law, found)
            found = replace(found, taken=tuple(one for one in found.taken if one not in others))
        judgement = judged(found, laws)
        if not judgement.incomplete():
            break
    return judgement


def _of_its_kind(law: Law, found: Shaped) -> list[int]:
    """Variants taken that are names for functions of what a law is one of."""
    candidates, owners = found.problems[0].candidates, found.regression.owners
    return [one for one in found.taken if is_of_its_kind(candidates[owners[one]], law)]


def _without(problem: Problem, refuted: Collection[str]) -> Problem:
    """A problem some of whose candidates the records speak against."""
    kept = (replace(one, excluded=one.excluded or one.key in refuted) for one in problem.candidates)
    return replace(problem, candidates=tuple(kept))

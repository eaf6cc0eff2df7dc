"""From two problems to an answer: search, judgement, and both again without what that refutes."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from threadpoolctl import threadpool_limits

from ident.gap.findings import Findings
from ident.gap.judgement import Judgement
from ident.gap.limits import Limits
from ident.gap.problem import Problem
from ident.gap.regression import Regression, Settings
from ident.gap.rows import make_rows
from ident.gap.search import concluded
from ident.gap.shapes import search


def judge(
    fit: Problem, confirm: Problem, *, seed: int, settings: Settings | None = None, limits: Limits | None = None
) -> Findings:
    """Find the causes of a gap.

    Args:
        fit: records that effects are looked for in.
        confirm: independent records, or a part of the same ones that took no part (`split_problem`).
        seed: of the surrogates and of the smooth function.
        settings, limits: thresholds.
    """
    settings, limits = settings or Settings(), limits or Limits()
    # Tall, thin matrices: more threads of the linear algebra library only wait for each other.
    with threadpool_limits(limits=1, user_api="blas"):
        judgement = _judged_once((fit, confirm), seed, settings, limits)
        while refuted := judgement.refuted():
            fit, confirm = (_without(problem, refuted) for problem in (fit, confirm))
            judgement = _judged_once((fit, confirm), seed, settings, limits)
        return judgement.findings()


def _judged_once(problems: tuple[Problem, Problem], seed: int, settings: Settings, limits: Limits) -> Judgement:
    searched = search(problems, Regression(problems[0], make_rows(*problems), settings, seed))
    found = concluded(searched.regression, searched.taken)
    judgement = Judgement(searched.problems, searched.regression, found, limits, seed)
    while (kept := judgement.worthwhile()) != found.variants:
        found = concluded(searched.regression, kept)
        judgement = Judgement(searched.problems, searched.regression, found, limits, seed)
    return judgement


def _without(problem: Problem, refuted: Collection[str]) -> Problem:
    """A problem some of whose candidates the records speak against."""
    kept = (replace(one, excluded=one.excluded or one.key in refuted) for one in problem.candidates)
    return replace(problem, candidates=tuple(kept))

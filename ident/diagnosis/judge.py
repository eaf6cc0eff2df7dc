"""From two problems to an answer: search, judgement, and both again without what that refutes."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from threadpoolctl import threadpool_limits

from ident.diagnosis.findings import Findings
from ident.diagnosis.judgement import Judgement
from ident.diagnosis.limits import Limits
from ident.diagnosis.problem import Problem
from ident.diagnosis.regression import Regression
from ident.diagnosis.rows import make_rows
from ident.diagnosis.search import concluded
from ident.diagnosis.settings import Settings
from ident.diagnosis.shapes import search
from ident.stages import Stage, untold


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

    Args:
        fit: records that effects are looked for in.
        confirm: independent records, or a part of the same ones that took no part (`split_problem`).
        seed: of the surrogates and of the smooth function.
        settings, limits: thresholds.
        stage: told what begins.
    """
    settings, limits = settings or Settings(), limits or Limits()
    # Tall, thin matrices: more threads of the linear algebra library only wait for each other.
    with threadpool_limits(limits=1, user_api="blas"):
        judgement = _judged_once((fit, confirm), seed, settings, limits, stage)
        while refuted := judgement.refuted():
            stage(f"again without {', '.join(sorted(refuted))}")
            fit, confirm = (_without(problem, refuted) for problem in (fit, confirm))
            judgement = _judged_once((fit, confirm), seed, settings, limits, stage)
        stage("numbers of the answer")
        return judgement.findings()


def _judged_once(
    problems: tuple[Problem, Problem], seed: int, settings: Settings, limits: Limits, stage: Stage
) -> Judgement:
    stage(f"searching {len(problems[0].candidates)} candidates")
    searched = search(problems, Regression(problems[0], make_rows(*problems), settings, seed))
    stage(f"fitting {len(searched.taken)} causes")
    found = concluded(searched.regression, searched.taken)
    judgement = Judgement(searched.problems, searched.regression, found, limits, seed)
    stage("trying them on the confirming records")
    while (kept := judgement.worthwhile()) != found.variants:
        found = concluded(searched.regression, kept)
        judgement = Judgement(searched.problems, searched.regression, found, limits, seed)
    return judgement


def _without(problem: Problem, refuted: Collection[str]) -> Problem:
    """A problem some of whose candidates the records speak against."""
    kept = (replace(one, excluded=one.excluded or one.key in refuted) for one in problem.candidates)
    return replace(problem, candidates=tuple(kept))

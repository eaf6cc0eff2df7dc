"""The answer: what follows from the best set of hypotheses, and from what may stand in the place of each member."""

from __future__ import annotations

import math

from scipy.special import logsumexp

from ident.diagnosis.answer.contest import better
from ident.diagnosis.answer.findings import Cause, Findings, ordered
from ident.diagnosis.answer.standing import INEXACT, OPEN, Standing
from ident.diagnosis.check.remainder import repeated, shares
from ident.diagnosis.diagnosis import LawAnswer, Verdict
from ident.diagnosis.evidence.state import State
from ident.diagnosis.law.answer import channel_of, law_answer, same_laws, same_names, unrecorded_variable
from ident.diagnosis.law.law import Law
from ident.diagnosis.names import LAW
from ident.diagnosis.noise.colours import Colours
from ident.diagnosis.observations.orders import with_orders
from ident.diagnosis.problem import Problem
from ident.diagnosis.search.asked import Asked, asked_beside, asked_beside_a_law, asked_of, asked_once_more
from ident.diagnosis.search.search import Search
from ident.stages import Stage, untold


def answer_of(fit: Problem, confirm: Problem, *, seed: int, stage: Stage = untold) -> Findings:
    """The answer of one piece; arguments of `judge`."""
    stage(f"comparing {len(fit.candidates)} causes and {len(fit.dependences)} laws")
    asked, search, state = _found(asked_of(with_orders((fit, confirm))), stage)
    if (again := asked_beside_a_law(asked, state)) is not None:
        stage("again, noise being what a law leaves")
        asked, search, state = _likelier(again, state, stage) or (asked, search, state)
    stage("numbers of the answer")
    standing = Standing(asked, search, state, seed)
    while (other := better(standing)) is not None:
        standing = Standing(asked, *other, seed)
    return _findings(standing)


def _found(asked: Asked, stage: Stage) -> tuple[Asked, Search, State]:
    """What is there, asked again beside it."""
    search = Search(asked.fitter)
    # Without repeats the first noise only leads to the second: what has grown by it leaves as much as what is best.
    state = search.run() if Colours.repeats(asked.regression) else search.grown(asked.fitter.nothing)
    if (again := asked_beside(asked, state)) is None:
        return asked, search, state
    stage("again beside what is there")
    search = Search(again.fitter)
    state = search.run()
    if (once_more := asked_once_more(asked, again, state)) is not None:
        again, search = once_more, Search(once_more.fitter)
        state = search.run()
    return again, search, state


def _likelier(asked: Asked, before: State, stage: Stage) -> tuple[Asked, Search, State] | None:
    """What another noise leads to that is likelier than a set; None where that is nothing.

    Args:
        asked: with that noise.
        before: the set.
        stage: told what begins.
    """
    grown = Search(asked.fitter).grown(asked.fitter.state(before.members, None))
    beside = asked_beside(asked, grown)
    if beside is None or beside.fitter.state(grown.members, None).log_posterior <= before.log_posterior:
        return None
    found = _found(asked, stage)
    return found if found[-1].log_posterior > before.log_posterior else None


def _findings(standing: Standing) -> Findings:
    """The answer, with all that reports show of it."""
    fitted, regression = standing.fitted, standing.taken.regression
    causes = ordered([_cause(standing, place, index) for place, index in enumerate(standing.taken.variants)])
    verdict = _verdict(standing)
    return Findings(
        verdict=verdict,
        causes=causes,
        doubtful=_doubtful(standing),
        gap=fitted.settled if verdict is Verdict.NONE else fitted.exactly,
        where=shares(regression.rows, fitted.floors, fitted.judged()),
        invisible=_invisible(standing),
        before=fitted.before,
        after=fitted.after,
        nothing=max((slot.nothing for slot in standing.slots.values()), default=None),
        remainder=fitted.rest,
        lacking=standing.is_lacking,
        repeated_before=repeated(regression.rows, fitted.floors, fitted.judged()),
        repeated_after=repeated(regression.rows, fitted.floors, fitted.after.blocks),
        problem=standing.taken.problems[0],
        held_out=fitted.held_out(),
        log_posterior=standing.state.log_posterior,
    )


def _doubtful(standing: Standing) -> dict[str, float]:
    """Probability of everything beside the set, or in its place if that is empty, the greatest first.

    But of what was in the set and lost its place: it was refuted or passed over, whatever its evidence is.
    """
    lost, hypotheses = standing.search.barred, standing.design.hypotheses
    odds = {index: log for index, log in standing.odds_beside.items() if index not in lost}
    whole = float(logsumexp([0.0, *odds.values()]))
    return {hypotheses[one].key: math.exp(odds[one] - whole) for one in sorted(odds, key=lambda one: -odds[one])}


def _verdict(standing: Standing) -> Verdict:
    if not standing.taken.variants:
        return Verdict.UNKNOWN if standing.is_lacking or _nameless(standing) else Verdict.NONE
    gap = standing.fitted.exactly
    closable = gap.before**2 - (gap.floor**2 if standing.is_measurable else 0.0)
    widened = gap.after**2 - gap.before**2 > INEXACT * closable
    if widened or (standing.is_lacking and gap.closed < 1 - OPEN):
        return Verdict.UNKNOWN
    return Verdict.LAW if standing.taken.laws else Verdict.EFFECT


def _nameless(standing: Standing) -> bool:
    """Whether something that the records refuted is likelier than nothing: what came along with it is there."""
    refuted = standing.search.refuted.keys() - standing.search.fitter.invisible
    return any(log > 0 for index, log in standing.odds_beside.items() if index in refuted)


def _invisible(standing: Standing) -> tuple[str, ...]:
    unseen = standing.search.fitter.invisible
    shown = {one.name for index, one in enumerate(standing.design.hypotheses) if index not in unseen}
    names = dict.fromkeys(str(one.effect) for one in standing.taken.problems[0].candidates)
    return tuple(name for name in names if name not in shown and not name.startswith(LAW))


def _cause(standing: Standing, place: int, index: int) -> Cause:
    slot, law, hypotheses = standing.slots[index], standing.taken.laws.get(index), standing.design.hypotheses
    ranked, dependences = slot.ranked(hypotheses, standing.unlisted), standing.taken.problems[0].dependences
    told = None if law is None else _law_answer(standing, law, index)
    return Cause(
        candidate=standing.fitted.candidate(place),
        part=standing.fitted.after.parts[place],
        ranked=ranked,
        probability=slot.probability(hypotheses, standing.unlisted),
        log_odds=slot.logs[index],
        # Nothing is said to widen a gap within the accidents of its noise.
        closed=max(standing.fitted.lacking[place], -math.inf if standing.is_measurable else 0.0),
        needed=standing.fitted.closed[place],
        biased=standing.fitted.biased(place),
        law=law,
        law_answer=told,
        alternatives=same_names(ranked.untold)
        if told is None
        else same_laws(ranked.alike, dependences, told.unrecorded),
    )


def _law_answer(standing: Standing, law: Law, index: int) -> LawAnswer:
    column, hypotheses = (
        standing.taken.regression.rows.layout[standing.taken.variants[index]],
        standing.design.hypotheses,
    )
    named = [(one, cosine) for one, cosine in standing.slots[index].cosines.items() if not hypotheses[one].free]
    nearest = max(named, key=lambda one: one[1], default=None)
    near = None if nearest is None else (hypotheses[nearest[0]].key, nearest[1])
    problems = standing.taken.problems
    return law_answer(law, channel_of(problems[0], column), near, unrecorded_variable(law, problems))

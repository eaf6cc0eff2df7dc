"""The answer: what follows from the best set of hypotheses, and from what may stand in the place of each member."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from ident.diagnosis.answer.findings import Cause, Findings, ordered
from ident.diagnosis.answer.taken import as_variants
from ident.diagnosis.check.fitted import Fitted, Taken
from ident.diagnosis.check.remainder import mostly_tolerated, repeated, shares
from ident.diagnosis.check.sized import SURELY, is_foreign, is_nothing, is_sizeless
from ident.diagnosis.diagnosis import LawAnswer, Verdict
from ident.diagnosis.evidence.state import State
from ident.diagnosis.law.answer import channel_of, curve_of, law_answer, same_laws, same_names
from ident.diagnosis.law.law import Law
from ident.diagnosis.law.reach import told_samples
from ident.diagnosis.names import LAW
from ident.diagnosis.noise.colours import SIZES, Colours
from ident.diagnosis.observations.orders import with_orders
from ident.diagnosis.problem import Problem
from ident.diagnosis.search.asked import Asked, asked_beside, asked_beside_a_law, asked_of, asked_once_more
from ident.diagnosis.search.search import Search
from ident.diagnosis.search.slots import slot_of
from ident.stages import Stage, untold

Array = NDArray[np.float64]

DOUBTED: Final = 0.5
"""Probability of nothing in its place, or of what has lost it, from which a member is none."""

EXACT: Final = 0.01
"""Share of the held-out gap that a member must close beside others, whose columns are exact to about as much."""

MEASURABLE: Final = 0.05
"""Power of what causes could close of a held-out gap, over the noise's, from which that is no accident of the noise."""

MISTAKEN: Final = 1.0
"""What is lacking, over noise and tolerance, that may be a mistake in those."""

OPEN: Final = 0.5
"""Share of the held-out gap that members leave, more being lacking than is tolerated, from which they are no answer."""

PAID: Final = 0.05
"""Log of what is above the noise that a member must gain beside greater ones, if it closes less than is exact."""

WIDENING: Final = 0.1
"""Share of the held-out gap by which a member, or all of them, may seem to widen it."""


def answer_of(fit: Problem, confirm: Problem, *, seed: int, stage: Stage = untold) -> Findings:
    """The answer of one piece; arguments of `judge`."""
    stage(f"comparing {len(fit.candidates)} causes and {len(fit.dependences)} laws")
    asked, search, state = _found(asked_of(with_orders((fit, confirm))), stage)
    if (again := asked_beside_a_law(asked, state)) is not None:
        stage("again, noise being what a law leaves")
        asked, search, state = _likelier(again, state, stage) or (asked, search, state)
    stage("numbers of the answer")
    answer = _Answer(asked, search, state, seed)
    while (other := answer.better()) is not None:
        search, state = other
        answer = _Answer(asked, search, state, seed)
    return answer.findings()


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


class _Answer:
    """What is computed of the best set."""

    def __init__(self, asked: Asked, search: Search, state: State, seed: int) -> None:
        self.search, self.state, self.design, self._seed = search, state, asked.design, seed
        excess, whole = search.fitter.excess(state), search.fitter.among_all(state)
        self.slots = {index: slot_of(search, whole, index, excess[index]) for index in state.members}
        self.taken = as_variants(asked.problems, asked.regression, asked.designs, self.design, state, self.slots)

    @cached_property
    def fitted(self) -> Fitted:
        """The exact refits of the members."""
        regression = self.taken.regression
        keys = [law.dependence.key for law in self.taken.laws.values()]
        found = Taken(tuple(self.taken.variants.values()), self.state.evidence.noise)
        told = told_samples(regression.rows, self.taken.problems, keys)
        return Fitted(self.taken.problems, regression, found, self._seed, told)

    def better(self) -> tuple[Search, State] | None:
        """The search and its set without members that are no answer; None: all are.

        Less likely there than nothing or than a rival, a trifle, of no size, widening the held-out gap, or making no
        difference.
        """
        # The search, in whose other places something else stood, would take again what is doubted.
        if doubted := self._doubted():
            return self._without(doubted, passed_over=doubted)
        if (corrected := self._corrected()) is not None:
            return corrected
        # What follows asks for exact refits, which a set that loses a member before is not worth.
        if trifling := self._trifling():
            return self._without(trifling, passed_over=trifling)
        refuted = self._sizeless() or self._widening() or self._needless()
        return self._without(refuted, refuted=refuted) if refuted else None

    def _without(
        self, lost: Sequence[int], *, refuted: Sequence[int] = (), passed_over: Sequence[int] = ()
    ) -> tuple[Search, State]:
        """The search and its set without members that have lost their places."""
        left = {index: one for index, one in self.state.members.items() if index not in lost}
        search = self.search.without(refuted=refuted, passed_over=passed_over)
        return search, search.further(search.fitter.state(left, self.state))

    def _corrected(self) -> tuple[Search, State] | None:
        """With the rival that is most ahead of a member in its place, evidence tempered; None: none is.

        What has lost a place to another once does not get it back.
        """
        ahead = {index: slot.ahead(self.search.passed_over) for index, slot in self.slots.items()}
        places = [(*one, index) for index, one in ahead.items() if one is not None]
        if not places:
            return None
        _, rival, index = max(places)
        search = self.search.without(passed_over=[index])
        return search, search.further(self.slots[index].rivals[rival])

    def _doubted(self) -> list[int]:
        """The member that is least likely to be there, if that is less likely than not.

        Or a law that the fitted rows do not show by themselves, which is not among those taken.
        """
        lost = {index: slot.lost(self.search.passed_over) for index, slot in self.slots.items()}
        doubted = [index for index in lost if lost[index] > DOUBTED or index not in self.taken.variants]
        return sorted(doubted, key=lambda index: -lost[index])[:1]

    def _sizeless(self) -> list[int]:
        """All members that are of no size of their own."""
        return [index for place, index in enumerate(self.taken.variants) if not self._has_size(place)]

    def _trifling(self) -> list[int]:
        """All members that are no more than what is tolerated, or laws that are nowhere surely not zero."""
        taken = enumerate(self.taken.variants)
        return [index for place, index in taken if self._is_tolerated(place) or not self._is_sure(index)]

    def _is_sure(self, index: int) -> bool:
        """Whether a law is surely not zero somewhere; a name says so by its size."""
        law = self.taken.laws.get(index)
        if law is None:
            return True
        _, y, std = curve_of(law).T
        return bool(np.any(np.abs(y) > SURELY * std))

    def _is_tolerated(self, place: int) -> bool:
        """Whether a member is no more than what a model may have wrong in all rows in which it acts."""
        reached, blocks = self.fitted.reached_by(place), [block for block, _ in self.fitted.rows.blocks]
        acting = [pair for pair in zip(blocks, self.fitted.floors.tolist(), strict=True) if pair[0].label in reached]
        return all(mostly_tolerated(*pair) for pair in acting) and self.fitted.lacking[place] <= 0

    def _widening(self) -> list[int]:
        """The member that widens the held-out gap most, if any does."""
        widened = [place for place, closed in enumerate(self.fitted.lacking) if closed < -WIDENING]
        return self._closing_least(widened) if self._measurable() else []

    def _needless(self) -> list[int]:
        """The member that closes least, if that is next to nothing beside others, or where there is a gap to close."""
        trifles = [place for place in range(self.fitted.count) if not self._pays(place)]
        return self._closing_least(trifles) if self.fitted.count > 1 or self._measurable() else []

    def _closing_least(self, places: Sequence[int]) -> list[int]:
        """That one of some members."""
        members = tuple(self.taken.variants)
        return [members[place] for place in sorted(places, key=self.fitted.lacking.__getitem__)[:1]]

    def _pays(self, place: int) -> bool:
        """Whether a member closes what its columns are exact to, or much of what a greater one leaves."""
        return self.fitted.lacking[place] >= EXACT or self.fitted.gain(place) >= PAID

    def _measurable(self) -> bool:
        """Whether the held-out gap that causes could close is more than an accident of the noise."""
        return self.fitted.removable > MEASURABLE * self.fitted.whole.floor**2

    def _has_size(self, place: int) -> bool:
        """Whether a size is surely not zero, and its own, and the numbers are of the effect's family.

        Numbers that trade for each other, as a friction and the speed at which it falls off, have wide deviations each:
        an effect of the family without which most of the held-out gap stays is surely not zero.
        """
        candidate, part = self.fitted.candidate(place), self.fitted.after.parts[place]
        if is_nothing(candidate, part):
            return not is_foreign(candidate, part) and self._measurable() and self.fitted.lacking[place] > OPEN
        return not is_sizeless(candidate, part)

    def findings(self) -> Findings:
        """The answer, with all that reports show of it."""
        fitted, regression = self.fitted, self.taken.regression
        causes = ordered([self._cause(place, index) for place, index in enumerate(self.taken.variants)])
        verdict = self._verdict()
        return Findings(
            verdict=verdict,
            causes=causes,
            doubtful=self._doubtful(),
            gap=fitted.settled if verdict is Verdict.NONE else fitted.exactly,
            where=shares(regression.rows, fitted.floors, fitted.judged()),
            invisible=self._invisible(),
            before=fitted.before,
            after=fitted.after,
            nothing=max((slot.nothing for slot in self.slots.values()), default=None),
            remainder=fitted.rest,
            lacking=self._lacking,
            repeated_before=repeated(regression.rows, fitted.floors, fitted.judged()),
            repeated_after=repeated(regression.rows, fitted.floors, fitted.after.blocks),
            problem=self.taken.problems[0],
            held_out=fitted.held_out(),
        )

    def _doubtful(self) -> dict[str, float]:
        """Probability of everything beside the set, or in its place if that is empty, the greatest first.

        But of what was in the set and lost its place: that was by tempered evidence.
        """
        lost, hypotheses = self.search.refuted | self.search.passed_over, self.design.hypotheses
        odds = {index: log for index, log in self._odds_beside.items() if index not in lost}
        whole = float(logsumexp([0.0, *odds.values()]))
        return {hypotheses[one].key: math.exp(odds[one] - whole) for one in sorted(odds, key=lambda one: -odds[one])}

    @cached_property
    def _odds_beside(self) -> dict[int, float]:
        """Log odds of everything that can be there beside the set, evidence not tempered."""
        tables = self.search.fitter.among_all(self.state).tables()
        hypotheses = self.design.hypotheses
        return {index: one.total - hypotheses[index].price for index, one in tables.items() if one.is_there}

    @cached_property
    def _lacking(self) -> bool:
        """Whether more is lacking somewhere than noise and tolerance that are not known exactly.

        Of rows without repeats the noise is what the fitted ones leave: the confirming ones may say more.
        """
        if any(SIZES[size] > MISTAKEN for size in self.state.evidence.sizes):
            return True
        gap = self.fitted.beside_what_is_known
        return not Colours.repeats(self.taken.regression) and gap.after > math.hypot(1.0, MISTAKEN) * gap.floor

    def _verdict(self) -> Verdict:
        if not self.taken.variants:
            return Verdict.UNKNOWN if self._lacking or self._nameless() else Verdict.NONE
        least = 1 - OPEN if self._lacking else -WIDENING if self._measurable() else -math.inf
        if self.fitted.exactly.closed < least:
            return Verdict.UNKNOWN
        return Verdict.LAW if self.taken.laws else Verdict.EFFECT

    def _nameless(self) -> bool:
        """Whether something that the records refuted is likelier than nothing: what came along with it is there."""
        refuted = self.search.refuted - self.search.fitter.invisible
        return any(log > 0 for index, log in self._odds_beside.items() if index in refuted)

    def _invisible(self) -> tuple[str, ...]:
        shown = {
            one.name for index, one in enumerate(self.design.hypotheses) if index not in self.search.fitter.invisible
        }
        names = dict.fromkeys(str(one.effect) for one in self.taken.problems[0].candidates)
        return tuple(name for name in names if name not in shown and not name.startswith(LAW))

    def _cause(self, place: int, index: int) -> Cause:
        slot, law, hypotheses = self.slots[index], self.taken.laws.get(index), self.design.hypotheses
        alike = [hypotheses[one].key for one in slot.alike]
        return Cause(
            candidate=self.fitted.candidate(place),
            part=self.fitted.after.parts[place],
            ranked=slot.ranked(hypotheses),
            probability=slot.probability(hypotheses),
            log_odds=slot.logs[index],
            # Nothing is said to widen a gap within the accidents of its noise.
            closed=max(self.fitted.lacking[place], -math.inf if self._measurable() else 0.0),
            needed=self.fitted.closed[place],
            biased=self.fitted.biased(place),
            law=law,
            law_answer=None if law is None else self._law_answer(law, index),
            alternatives=same_names(alike) if law is None else same_laws(alike, self.taken.problems[0].dependences),
        )

    def _law_answer(self, law: Law, index: int) -> LawAnswer:
        column = self.taken.regression.rows.layout[self.taken.variants[index]]
        named = [
            (one, cosine) for one, cosine in self.slots[index].cosines.items() if not self.design.hypotheses[one].free
        ]
        nearest = max(named, key=lambda one: one[1], default=None)
        near = None if nearest is None else (self.design.hypotheses[nearest[0]].key, nearest[1])
        return law_answer(law, channel_of(self.taken.problems[0], column), near)

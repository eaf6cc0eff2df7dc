"""The search: sets of hypotheses, one after the other."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Final

from ident.diagnosis.evidence.fitting import Fitter
from ident.diagnosis.evidence.state import State
from ident.diagnosis.evidence.tables import Member

MOST: Final = 4
"""Members of a set."""

TURNS: Final = 4
"""Times that every place is looked at anew."""

INSTEAD: Final = 2
"""Names that may stand for a law."""

SURVIVORS: Final = 3
"""Names, and laws, that are fitted exactly in a round, by either noise: of 1015 steps on four records of robots, whose
sets are large, 3 took a later one, and none of 57 on vehicles."""

ROUNDS: Final = 2
"""Times that those which promise most are fitted: what promises most of all may keep none of it."""

MARGIN: Final = 4.0
"""Log posterior below the best one's from which a hypothesis is not fitted exactly."""


Lost = Mapping[int, frozenset[int]]
"""Hypotheses that lost their places, and the set of each then, by number."""

Promises = Mapping[int, tuple[float, Member]]
"""Log odds of a hypothesis by its columns, and its numbers, by number of the hypothesis."""


class Search:
    """Looks for the set of hypotheses with the largest posterior.

    Args:
        fitter: of the sets.
        refuted: hypotheses that the records speak against, or that have no size or make no difference beside others,
            and those others, whose rivals they still are.
        passed_over: those that nothing, or another one, is more likely than, and what stood beside each then; what did
            not may still be taken for it.
    """

    def __init__(
        self, fitter: Fitter, refuted: Lost = MappingProxyType({}), passed_over: Lost = MappingProxyType({})
    ) -> None:
        self.fitter, self.design = fitter, fitter.design
        self.refuted: Lost = {**dict.fromkeys(fitter.invisible, frozenset[int]()), **refuted}
        self.passed_over = passed_over

    def refuting(self, lost: Collection[int], beside: Collection[int] = ()) -> Search:
        """The same search, some hypotheses more refuted; what they trade for has them for rivals."""
        return Search(self.fitter, {**self.refuted, **dict.fromkeys(lost, frozenset(beside))}, self.passed_over)

    def passing_over(self, lost: Collection[int], beside: Collection[int] = ()) -> Search:
        """The same search, some hypotheses more passed over beside what stands."""
        return Search(self.fitter, self.refuted, {**self.passed_over, **dict.fromkeys(lost, frozenset(beside))})

    @property
    def barred(self) -> frozenset[int]:
        """Hypotheses that are not looked for any more."""
        return frozenset(self.refuted.keys() | self.passed_over.keys())

    def stands_for(self, index: int) -> frozenset[int]:
        """Those passed over that a member may have been taken for: it did not stand beside them."""
        return frozenset(one for one, beside in self.passed_over.items() if index not in beside)

    def may_stand(self, one: int, index: int) -> bool:
        """Whether a hypothesis is a rival in the place of a member."""
        return one not in self.refuted or index in self.refuted[one]

    def run(self) -> State:
        """The best set that was found."""
        return self.further(self.fitter.nothing)

    def grown(self, state: State) -> State:
        """With further members, each of which tempered evidence makes likelier than nothing."""
        while len(state.members) < MOST:
            further = self._pruned(self._believed(state))
            if further.log_posterior <= state.log_posterior:
                break
            state = further
        return state

    def further(self, state: State) -> State:
        """The best set that was found, beginning with another."""
        best = self._against_rivals(self.grown(state))
        named = self._named(best)
        # Names that stand for a law were taken one after the other.
        return best if named is best else self._against_rivals(named)

    def _believed(self, state: State, *, named: bool = False) -> State:
        """The best set with one member more that is likelier than nothing, evidence tempered; or the same, without any.

        What noise that is not quite as it is taken to be makes likely would crowd out what is there.

        Args:
            state: the set.
            named: only what has a name.
        """
        promises, doubted = self._promises(state, named), set[int]()
        for _ in range(ROUNDS):
            tried = self._expanded(state, promises, doubted)
            for index, one in sorted(tried.items(), key=lambda entry: -entry[1].log_posterior):
                if one.log_posterior <= state.log_posterior:
                    break
                further = self.fitter.state(one.members, one)
                if self.fitter.odds(further, index, state) > 0:
                    return further
            doubted |= tried.keys()
        return state

    def _against_rivals(self, state: State) -> State:
        """With the best hypothesis in the place of every member."""
        for _ in range(TURNS):
            before = state
            for index in before.members:
                bare = self.fitter.state(before.without(index), before)
                state = max((state, self._believed(bare)), key=lambda one: one.log_posterior)
            if state is before:
                break
        return state

    def _expanded(self, state: State, promises: Sequence[Promises], doubted: Collection[int]) -> dict[int, State]:
        """Sets with one member more, by its number, of those that promise most of what is not doubted."""
        found = dict[int, Member]()
        for one in promises:
            ordered = sorted((index for index in one if index not in doubted), key=lambda index: -one[index][0])
            for index in ordered[:SURVIVORS]:
                odds, member = one[index]
                least = max(one[ordered[0]][0], 0.0) - MARGIN
                # What is no more than its columns promises what it keeps.
                if odds > (least if self.fitter.is_bent(index, member) else max(least, 0.0)):
                    found.setdefault(index, member)
        return {
            index: self.fitter.state({**state.members, index: one}, state, state.members)
            for index, one in found.items()
        }

    def _promises(self, state: State, named: bool) -> Sequence[Promises]:
        """Of names and of laws, by the noise that is left, and by that of which nothing is lacking.

        What a model lacks may be as large as what is looked for, and hide it. A law, which is free to follow anything,
        promises more than names do, and keeps less.
        """
        whole, usual = self.fitter.among_all(state), self.fitter.with_nothing_lacking(state)
        noises = (whole, usual) if usual.evidence is not whole.evidence else (whole,)
        return [kind for one in noises for kind in self._promised(one, (False,) if named else (False, True))]

    def _promised(self, state: State, laws: Sequence[bool]) -> Iterator[Promises]:
        """Of every kind."""
        hypotheses, barred, tables = self.design.hypotheses, self.barred, state.tables()
        for law in laws:
            yield {
                index: (table.total - hypotheses[index].price, table.best)
                for index, table in tables.items()
                if table.is_there and index not in barred and hypotheses[index].free is law
            }

    def _pruned(self, state: State) -> State:
        """Without members that the others make needless."""
        while len(state.members) > 1:
            fewer = [self.fitter.state(state.without(index), state) for index in state.members]
            best = max(fewer, key=lambda one: one.log_posterior)
            if best.log_posterior < state.log_posterior:
                break
            state = best
        return state

    def _named(self, state: State) -> State:
        """With names in the place of every law that is not better."""
        for index in [one for one in state.members if self.design.hypotheses[one].free]:
            bare = self.fitter.state(state.without(index), state)
            least, instead = max(state.log_posterior, bare.log_posterior), bare
            while len(instead.members) < min(len(bare.members) + INSTEAD, MOST):
                further = self._believed(instead, named=True)
                if further is instead:
                    break
                instead = further
                if instead.log_posterior > least:
                    state = instead
                    break
        return state

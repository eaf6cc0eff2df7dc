"""The search: sets of hypotheses, one after the other."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
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
"""Hypotheses that are fitted exactly at every step, by either noise: of 1015 steps on four records of robots, whose
sets are large, 3 took a later one, and none of 57 on vehicles."""

MARGIN: Final = 4.0
"""Log posterior below the best one's from which a hypothesis is not fitted exactly."""


Promises = Mapping[int, tuple[float, Member]]
"""Log odds of a hypothesis by its columns, and its numbers, by number of the hypothesis."""


class Search:
    """Looks for the set of hypotheses with the largest posterior.

    Args:
        fitter: of the sets.
        refuted: hypotheses that the records speak against, or that make no difference held out.
        passed_over: those that nothing, or another one, is more likely than; another may still be taken for them.
    """

    def __init__(
        self, fitter: Fitter, refuted: frozenset[int] = frozenset(), passed_over: frozenset[int] = frozenset()
    ) -> None:
        self.fitter, self.design = fitter, fitter.design
        self.refuted = refuted | fitter.invisible
        self.passed_over = passed_over

    def without(self, *, refuted: Collection[int] = (), passed_over: Collection[int] = ()) -> Search:
        """The same search, some hypotheses more refuted, or passed over."""
        return Search(self.fitter, self.refuted | frozenset(refuted), self.passed_over | frozenset(passed_over))

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
        while True:
            best = max(self._expanded(state, promises, doubted), key=lambda one: one.log_posterior, default=state)
            if best.log_posterior <= state.log_posterior:
                return state
            best = self.fitter.state(best.members, best)
            (index,) = best.members.keys() - state.members.keys()
            if self.fitter.odds(best, index, state) > 0:
                return best
            doubted.add(index)

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

    def _expanded(self, state: State, promises: Sequence[Promises], doubted: Collection[int]) -> Sequence[State]:
        """Sets with one member more, of those that promise most of what is not doubted."""
        found = dict[int, Member]()
        for one in promises:
            ordered = sorted((index for index in one if index not in doubted), key=lambda index: -one[index][0])
            for index in ordered[:SURVIVORS]:
                odds, member = one[index]
                least = max(one[ordered[0]][0], 0.0) - MARGIN
                # What is no more than its columns promises what it keeps.
                if odds > (least if self.fitter.is_bent(index, member) else max(least, 0.0)):
                    found.setdefault(index, member)
        return [self.fitter.state({**state.members, index: one}, state, state.members) for index, one in found.items()]

    def _promises(self, state: State, named: bool) -> Sequence[Promises]:
        """Of all hypotheses, or of names, by the noise that is left, and by that of which nothing is lacking.

        What a model lacks may be as large as what is looked for, and hide it.
        """
        hypotheses, barred = self.design.hypotheses, self.refuted | self.passed_over
        whole, usual = self.fitter.among_all(state), self.fitter.with_nothing_lacking(state)
        return [
            {
                index: (table.total - hypotheses[index].price, table.best)
                for index, table in one.tables().items()
                if table.is_there and index not in barred and not (named and hypotheses[index].free)
            }
            for one in ((whole, usual) if usual.evidence is not whole.evidence else (whole,))
        ]

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

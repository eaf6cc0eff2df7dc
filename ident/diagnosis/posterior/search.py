"""The search: sets of hypotheses, one after the other."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Final

from ident.diagnosis.posterior.evidence import Member
from ident.diagnosis.posterior.fitting import Fitter
from ident.diagnosis.posterior.state import State

MOST: Final = 4
"""Members of a set."""

TURNS: Final = 4
"""Times that every place is looked at anew."""

INSTEAD: Final = 2
"""Names that may stand for a law."""

SURVIVORS: Final = 5
"""Hypotheses that are fitted exactly at every step, by either noise."""

MARGIN: Final = 4.0
"""Log posterior below the best one's from which a hypothesis is not fitted exactly."""


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

    def further(self, state: State) -> State:
        """The best set that was found, beginning with another."""
        while len(state.members) < MOST:
            further = max(self._expanded(state), key=lambda one: one.log_posterior, default=state)
            further = self._pruned(further)
            if further.log_posterior <= state.log_posterior:
                break
            state = further
        best = self._against_rivals(state)
        named = self._named(best)
        # Names that stand for a law were taken one after the other.
        return best if named is best else self._against_rivals(named)

    def _against_rivals(self, state: State) -> State:
        """With the best hypothesis in the place of every member."""
        for _ in range(TURNS):
            before = state
            for index in before.members:
                bare = self.fitter.state(before.without(index), before)
                state = max((state, *self._expanded(bare)), key=lambda one: one.log_posterior)
            if state is before:
                break
        return state

    def _expanded(self, state: State, *, named: bool = False) -> Sequence[State]:
        """Sets with one member more, of those that promise most; or of those alone that have a name."""
        return [
            self.fitter.state({**state.members, index: one}, state)
            for index, one in self._promising(state, named).items()
        ]

    def _promising(self, state: State, named: bool) -> dict[int, Member]:
        """Hypotheses by the noise that is left, and by that of which nothing is lacking.

        What a model lacks may be as large as what is looked for, and hide it.
        """
        hypotheses = self.design.hypotheses
        whole, usual = self.fitter.among_all(state), self.fitter.with_nothing_lacking(state)
        found, barred = dict[int, Member](), self.refuted | self.passed_over
        for one in (whole, usual) if usual.evidence is not whole.evidence else (whole,):
            tables = {
                index: table
                for index, table in one.tables().items()
                if table.is_there and index not in barred and not (named and hypotheses[index].free)
            }
            odds = {index: table.total - hypotheses[index].price for index, table in tables.items()}
            most = max(odds.values(), default=0.0)
            best = [index for index in sorted(odds, key=lambda index: -odds[index]) if odds[index] > most - MARGIN]
            for index in best[:SURVIVORS]:
                if odds[index] > -MARGIN:
                    found.setdefault(index, tables[index].best)
        return found

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
            for _ in range(INSTEAD):
                instead = max(self._expanded(instead, named=True), key=lambda one: one.log_posterior, default=instead)
                if instead is not bare and instead.log_posterior > least:
                    state = instead
                    break
        return state

"""What may stand in the place of a member, the others given: nothing, and every hypothesis by its posterior."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from ident.diagnosis.evidence.misfit import tempered
from ident.diagnosis.evidence.state import State
from ident.diagnosis.hypotheses.gram import Beside
from ident.diagnosis.hypotheses.hypotheses import Hypothesis
from ident.diagnosis.observations.linear import ROUNDING
from ident.diagnosis.search.ranked import Ranked
from ident.diagnosis.search.search import Search

Array = NDArray[np.float64]

NEAR: Final = 6.0
"""Log posterior below a member's up to which a rival is fitted exactly as well: one in four hundred."""

BETWEEN: Final = 0.2
"""The same as a part of a member's: what columns may lack whose numbers lie between those that they were made for."""

RIVALS: Final = 4
"""That are fitted exactly."""

UNLISTED: Final = 0.03
"""Probability that what stands in a place is none of the hypotheses as they are written, however likely one is among
them, where little of the gap is left: of 35 names of drawn machines that were sure, one was wrong."""

SAME: Final = 0.9999
"""Cosine of what two names of as many numbers add to the rows, from which those do not tell them apart."""

SAME_LAW: Final = 0.98
"""The same of two laws: what is learnt is known to about as much."""


@dataclass(frozen=True)
class Slot:
    """One place of the best set.

    Attributes:
        logs: log posterior odds of every hypothesis against nothing there, the greatest first.
        cosines: of what the member adds and what every other can.
        alike: hypotheses of its kind, names or laws, that add the same, the member first.
        rivals: sets with another hypothesis there, of those that were fitted exactly.
        excess: of the scatter of the rows over their noise, along the member.
    """

    logs: Mapping[int, float]
    cosines: Mapping[int, float]
    alike: tuple[int, ...]
    rivals: Mapping[int, State]
    excess: float

    def ahead(self, barred: Collection[int]) -> tuple[float, int] | None:
        """By how much the most likely rival is more likely, of those fitted exactly and not barred; None if none is."""
        rivals = [one for one in self.rivals if one not in barred]
        most = max(rivals, key=lambda one: self.logs.get(one, -math.inf), default=None)
        lead = -math.inf if most is None else self.logs.get(most, -math.inf) - self.logs.get(self.alike[0], -math.inf)
        return (lead, most) if most is not None and lead > 0 else None

    @cached_property
    def _whole(self) -> float:
        return float(logsumexp([0.0, *self.logs.values()]))

    def _probabilities(self, unlisted: float) -> dict[int, float]:
        return {index: (1 - unlisted) * math.exp(log - self._whole) for index, log in self.logs.items()}

    @property
    def nothing(self) -> float:
        """Probability that there is nothing."""
        return math.exp(-self._whole)

    def lost(self, barred: Collection[int]) -> float:
        """Probability that there is nothing, or what may not stand there and does not add the same."""
        others = [self.logs[one] for one in barred if one in self.logs and one not in self.alike]
        return math.exp(float(logsumexp([0.0, *others])) - self._whole)

    def names(self, hypotheses: Sequence[Hypothesis], unlisted: float) -> dict[str, float]:
        """Probability of every name, the most probable first; arguments of `ranked`."""
        found: dict[str, float] = {}
        for index, probability in self._probabilities(unlisted).items():
            name = hypotheses[index].name
            found[name] = found.get(name, 0.0) + probability
        return dict(sorted(found.items(), key=lambda entry: -entry[1]))

    def probability(self, hypotheses: Sequence[Hypothesis], unlisted: float) -> float:
        """That the name of the member is right, or that of one which adds the same; arguments of `ranked`."""
        names = self.names(hypotheses, unlisted)
        return min(sum(names[name] for name in {hypotheses[one].name for one in self.alike}), 1.0)

    def ranked(self, hypotheses: Sequence[Hypothesis], unlisted: float) -> Ranked:
        """As reports show it.

        Args:
            hypotheses: all of them.
            unlisted: probability that what stands there is none of them as they are written.
        """
        named = {hypotheses[index].key: each for index, each in self._probabilities(unlisted).items()}
        evidence = {hypotheses[index].key: log for index, log in self.logs.items()}
        alike = tuple(hypotheses[one].key for one in self.alike)
        return Ranked(named, self.names(hypotheses, unlisted), alike, evidence, unlisted)


def slot_of(search: Search, state: State, index: int, excess: float) -> Slot:
    """What may stand in the place of a member: rivals that come near by their columns are fitted exactly.

    Args:
        search: that found the set.
        state: the set, with the evidence of all hypotheses.
        index: of the member.
        excess: of the scatter of the rows over their noise, along the member.
    """
    place = _Place(search, state, index, excess)
    place.fit_rivals()
    odds = {one: place.odds(one) for one in place.logs}
    logs = {one: log for one, log in sorted(odds.items(), key=lambda entry: -entry[1]) if math.isfinite(log)}
    cosines, hypotheses = _cosines(state, index, logs), search.design.hypotheses
    block, law = hypotheses[index].blocks[state.members[index].block], hypotheses[index].free
    alike = [
        one
        for one, (cosine, size) in cosines.items()
        if one != index
        and hypotheses[one].free is law
        and (cosine > SAME_LAW if law else cosine > SAME and size == len(block.factor))
    ]
    return Slot(logs, {one: cosine for one, (cosine, _) in cosines.items()}, (index, *alike), place.rivals, excess)


class _Place:
    """Odds in the place of a member, by columns, or of rivals that were fitted exactly; arguments of `slot_of`.

    Attributes:
        logs: log posterior odds of every hypothesis against nothing, evidence not tempered.
        rivals: sets with another hypothesis there, fitted exactly.
    """

    def __init__(self, search: Search, state: State, index: int, excess: float) -> None:
        self._search, self._state, self._index = search, state, index
        self._others = others = state.without(index)
        bends = {one: bend for one, bend in state.bends.items() if one != index}
        without = replace(state, members=others, bends=bends)
        self._target, self._beside = without.target, without.target.beside(others)
        bare = search.fitter.state(others, state).log_posterior
        # Others that cannot be there without it, by their sign, are no ground to stand on.
        self._bare = bare if math.isfinite(bare) else search.fitter.nothing.log_posterior
        # Without it the rows may have another noise.
        base = without.log_posterior - self._bare if math.isfinite(without.log_posterior) else 0.0
        self.logs, self._costs, self.rivals = dict[int, float](), dict[int, float](), dict[int, State]()
        hypotheses = search.design.hypotheses
        possible = [one for one in range(len(hypotheses)) if one not in others and search.may_stand(one, index)]
        for number, table in self._target.tables(possible, self._beside).items():
            if table.is_there:
                self.logs[number] = base + table.total - hypotheses[number].price
                self._costs[number] = table.cost + hypotheses[number].price
        self._own = dict[int, float]()
        self._keep(index, state, excess)

    def odds(self, one: int) -> float:
        """Log odds, evidence tempered: of rivals alike, but of what is none by the scatter of its own rows by that.

        Alike by the scatter beside what fits the rows best. Were it the member's, each of two might be less likely than
        the other where that one is the member.
        """
        scatter = self._own[max(self._own, key=self.logs.__getitem__)]
        compared = tempered(self.logs[one], self._costs[one], scatter)
        alone = tempered(self.logs[one], self._costs[one], self._own.get(one, scatter))
        return compared if alone > 0 else min(alone, compared)

    def fit_rivals(self) -> None:
        """Fit those near the member, and whatever is the likeliest."""
        least = self.odds(self._index) - max(NEAR, BETWEEN * self.odds(self._index))
        others = sorted((one for one in self.logs if one != self._index), key=lambda one: -self.odds(one))
        for rival in [one for one in others[:RIVALS] if self.odds(one) > least]:
            self._fit(rival)
        while (first := max(self.logs, key=self.odds)) != self._index and first not in self.rivals:
            self._fit(first)

    def _fit(self, rival: int) -> None:
        best = self._target.table(rival, self._beside).best
        fitted = self.rivals[rival] = self._search.fitter.state({**self._others, rival: best}, self._state)
        if math.isfinite(fitted.log_posterior):
            self._keep(rival, fitted, self._search.fitter.excess(fitted)[rival])
        else:
            self.logs[rival] = -math.inf

    def _keep(self, one: int, fitted: State, excess: float) -> None:
        self.logs[one], self._costs[one] = fitted.log_posterior - self._bare, fitted.cost(one)
        self._own[one] = excess


def _cosines(state: State, index: int, others: Mapping[int, float]) -> dict[int, tuple[float, int]]:
    """Of what a member adds to the white rows beside the others, and what each other can; by how many columns.

    By whatever its columns can make, of a law at all lengths together.
    """
    products, hypotheses = state.target.beside(state.without(index)), state.evidence.design.hypotheses
    own = hypotheses[index].blocks[state.members[index].block].place
    mean = state.target.means(state.members)[index]
    power = float(mean @ products.of(own, own) @ mean)
    found = {}
    for other in others:
        # A law has the same columns at every length.
        places = {block.place.start: block.place for block in hypotheses[other].blocks}
        made = [(_reached(products, place, own, mean), place.stop - place.start) for place in places.values()]
        best, width = max(made, key=lambda one: one[0])
        found[other] = math.sqrt(min(best / power, 1.0)) if power > 0 else 0.0, width
    return found


def _reached(products: Beside, place: slice, own: slice, mean: Array) -> float:
    """Power of what columns of a place can make of what those of a member add, with these coefficients."""
    along = products.of(place, own) @ mean
    if len(along) == 1:
        power = float(products.diagonal[place.start])
        return float(along[0]) ** 2 / power if power > 0 else 0.0
    powers, turn = np.linalg.eigh(products.of(place, place))
    kept = powers > ROUNDING * powers.max()
    return float(np.sum((along @ turn[:, kept]) ** 2 / powers[kept]))

"""The search: sets of hypotheses, one after the other, each set with the noise that it leaves."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.core.evidence import Design, Evidence, Member, Table
from ident.diagnosis.core.noise import NONE, POWERS, Colours, Drift, Rows, Whitener, drifts, fit_whitener

Array = NDArray[np.float64]

SWEEPS: Final = 4
"""Times that the numbers of all members are chosen anew, each beside the others."""

MOST: Final = 4
"""Members of a set."""


@dataclass(frozen=True)
class State:
    """A set of hypotheses.

    Attributes:
        members: by hypothesis.
        evidence: with the noise that is most likely beside them.
    """

    members: Mapping[int, Member]
    evidence: Evidence

    @cached_property
    def log_evidence(self) -> float:
        """Of all rows, the numbers of the members integrated."""
        inside = sum(self.table(index).total - self.table(index).best[1] for index in self.members)
        return self.evidence.nothing + self.evidence.log_likelihood(self.members) + inside

    def table(self, hypothesis: int) -> Table:
        """Evidence of a hypothesis beside the other members."""
        return self.evidence.table(hypothesis, self._beside(hypothesis))

    def _beside(self, hypothesis: int) -> Array:
        return self.evidence.beside({index: one for index, one in self.members.items() if index != hypothesis})

    def slot(self, hypothesis: int) -> dict[int, Table]:
        """Evidence of everything that may stand in the place of a member."""
        products = self._beside(hypothesis)
        return {
            index: self.evidence.table(index, products)
            for index in range(len(self.evidence.design.hypotheses))
            if index == hypothesis or index not in self.members
        }


class Search:
    """Looks for the set of hypotheses with the largest posterior.

    Args:
        design: of the rows.
        price: log odds of one more member, before the rows.
    """

    def __init__(self, design: Design, price: float) -> None:
        self.design, self.price = design, price
        self._colours = [Colours(one) for one in design.observations]
        self._kept: dict[frozenset[int], State] = {}

    def run(self) -> State:
        """The best set that was found."""
        state = self.state({}, None)
        while len(state.members) < MOST:
            further = max(self._expanded(state), key=self.posterior, default=state)
            further = self._pruned(further)
            if self.posterior(further) <= self.posterior(state):
                break
            state = further
        return state

    def posterior(self, state: State) -> float:
        """Log of it, but for a constant."""
        return state.log_evidence - self.price * len(state.members)

    def _expanded(self, state: State) -> Sequence[State]:
        products = state.evidence.beside(state.members)
        tables = {
            index: state.evidence.table(index, products)
            for index in range(len(self.design.hypotheses))
            if index not in state.members
        }
        most = max((table.total for table in tables.values()), default=-math.inf)
        best = [i for i, table in tables.items() if table.total > max(self.price, most) - MARGIN]
        best = sorted(best, key=lambda index: -tables[index].total)[:SURVIVORS]
        return [self.state({**state.members, index: tables[index].best[0]}, state) for index in best]

    def _pruned(self, state: State) -> State:
        """Without members that the others make needless."""
        while len(state.members) > 1:
            fewer = max(
                (self.state({i: m for i, m in state.members.items() if i != index}, state) for index in state.members),
                key=self.posterior,
            )
            if self.posterior(fewer) < self.posterior(state):
                break
            state = fewer
        return state

    def state(self, members: Mapping[int, Member], before: State | None) -> State:
        """A set, its members' numbers fitted by turns, with the noise that they leave.

        Args:
            members: to begin with.
            before: a set that is nearly the same, whose noise is taken first.
        """
        key = frozenset(members)
        if key not in self._kept:
            found, evidence = dict(members), None if before is None else before.evidence
            for _ in range(SWEEPS if evidence is not None else 0):
                assert evidence is not None
                turned = {index: State(found, evidence).table(index).best[0] for index in found}
                if turned == found:
                    break
                found = turned
            self._kept[key] = State(found, Evidence(self.design, self._whiteners(found, before)))
        return self._kept[key]

    def _whiteners(self, members: Mapping[int, Member], before: State | None) -> list[Whitener]:
        found = []
        for record, (observation, colours) in enumerate(zip(self.design.observations, self._colours, strict=True)):
            blocks = [(self.design.blocks[one.block], one.scale) for one in members.values()]
            columns = [self.design.columns[record][:, block.place] @ (scale * block.factor) for block, scale in blocks]
            beside = np.hstack([np.zeros((len(observation), 0)), *columns])
            rows = Rows(colours, self.design.plant[record], observation.target, beside)
            if before is None:
                left = self._left(rows)
                found.append(fit_whitener(rows, drifts(observation), float(left @ left) / len(left)))
            else:
                known = before.evidence.whiteners[record]
                found.append(fit_whitener(rows, _nearby(known.drift), known.level))
        return found

    @staticmethod
    def _left(rows: Rows) -> Array:
        """(n,) what the plant leaves of the target."""
        size = np.linalg.norm(rows.design, axis=0)
        size[size == 0] = 1.0
        return rows.target - rows.design @ (np.linalg.lstsq(rows.design / size, rows.target, rcond=1e-7)[0] / size)


def _nearby(drift: Drift) -> list[Drift]:
    """The same, as much of it as is next to it, and none."""
    if not drift.power:
        return [NONE]
    at = POWERS.index(drift.power)
    return [drift, *(replace(drift, power=power) for power in POWERS[max(at - 2, 0) : at]), NONE]


SURVIVORS: Final = 4
"""Hypotheses that are fitted exactly at every step."""

MARGIN: Final = 3.0
"""Log evidence below its price from which a hypothesis is not fitted exactly: another noise hardly gives it more."""


def price_of(count: int) -> float:
    """Log odds against one of so many hypotheses, half of all machines lacking something."""
    return math.log(count)

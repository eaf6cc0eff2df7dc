"""The search: sets of hypotheses, one after the other, each set with the noise that it leaves."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from ident.diagnosis.core.design import Design
from ident.diagnosis.core.evidence import Evidence, Member, Table
from ident.diagnosis.core.noise import NONE, POWERS, Colours, Drift, Rows, Whitener, drifts, fit_whitener

Array = NDArray[np.float64]

SWEEPS: Final = 4
"""Times that the numbers of all members are chosen anew, each beside the others."""

NEAR: Final = 1.0
"""Log evidence that neighbouring numbers may differ by: more, and the largest is looked for between them."""

MOST: Final = 4
"""Members of a set."""


INSTEAD: Final = 2
"""Names that may stand for a law."""

SURVIVORS: Final = 4
"""Hypotheses that are fitted exactly at every step."""

MARGIN: Final = 3.0
"""Log evidence below its price from which a hypothesis is not fitted exactly: another noise hardly gives it more."""


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
        return self.evidence.table(hypothesis, self.without(hypothesis))

    def without(self, hypothesis: int) -> dict[int, Member]:
        """The other members."""
        return {index: one for index, one in self.members.items() if index != hypothesis}

    def tempered(self, temperature: float) -> State:
        """The same, all noise being that many times the power."""
        whiteners = [one.tempered(temperature) for one in self.evidence.whiteners]
        return State(self.members, Evidence(self.evidence.design, whiteners))

    @cached_property
    def led(self) -> State:
        """The same, the effort following by a filter and not late."""
        return State(self.members, Evidence(self.evidence.design, self.evidence.whiteners, led=True))

    def slot(self, hypothesis: int) -> dict[int, Table]:
        """Evidence of everything that may stand in the place of a member."""
        others = self.without(hypothesis)
        return {
            index: self.evidence.table(index, others)
            for index in range(len(self.evidence.design.hypotheses))
            if index not in others
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
        return self._named(state)

    def _named(self, state: State) -> State:
        """With names in the place of every law that they explain as well."""
        for index in [i for i in state.members if self.design.hypotheses[i].free]:
            instead = self.state(state.without(index), state)
            for _ in range(INSTEAD):
                instead = max(self._expanded(instead, named=True), key=self.posterior, default=instead)
            state = max(state, instead, key=self.posterior)
        return state

    def posterior(self, state: State) -> float:
        """Log of it, but for a constant."""
        return state.log_evidence - self.price * len(state.members)

    def _expanded(self, state: State, *, named: bool = False) -> Sequence[State]:
        """Sets with one member more, of those that promise most; or of those alone that have a name."""
        tables = {
            index: state.evidence.table(index, state.members)
            for index, hypothesis in enumerate(self.design.hypotheses)
            if index not in state.members and not (named and hypothesis.free)
        }
        most = max((table.total for table in tables.values()), default=-math.inf)
        best = [i for i, table in tables.items() if table.total > max(self.price, most) - MARGIN]
        best = sorted(best, key=lambda index: -tables[index].total)[:SURVIVORS]
        return [self.state({**state.members, index: tables[index].best[0]}, state) for index in best]

    def _pruned(self, state: State) -> State:
        """Without members that the others make needless."""
        while len(state.members) > 1:
            fewer = max(
                (self.state(state.without(index), state) for index in state.members),
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
            if before is None:
                self._kept[key] = State(members, Evidence(self.design, self._whiteners(self.design, members, None)))
            else:
                settled = refined(_settled(State(members, before.evidence)))
                design = settled.evidence.design
                whiteners = self._whiteners(design, settled.members, settled)
                self._kept[key] = _settled(State(settled.members, Evidence(design, whiteners)))
        return self._kept[key]

    def _whiteners(self, design: Design, members: Mapping[int, Member], before: State | None) -> list[Whitener]:
        found = []
        means = {} if before is None else before.evidence.means(members)
        for record, (observation, colours) in enumerate(zip(design.observations, self._colours, strict=True)):
            blocks = [(design.blocks[one.block], one.scale) for one in members.values()]
            for index, one in members.items():
                response = design.hypotheses[index].response
                if response is not None:
                    number, mean = design.blocks[one.block].number, float(means[index][0])
                    colours = colours.amplified(partial(_scaled, response, number, mean))
            columns = [design.columns[record][:, block.place] @ (scale * block.factor) for block, scale in blocks]
            beside = np.hstack([np.zeros((len(observation), 0)), *columns])
            rows = Rows(colours, design.plant[record], observation.target, beside)
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
        found = np.linalg.lstsq(rows.design / size, rows.target, rcond=1e-7)[0] / size
        return np.asarray(rows.target - rows.design @ found)


def _settled(state: State) -> State:
    """With the numbers of every member chosen anew, each beside the others."""
    for _ in range(SWEEPS):
        turned = {index: state.table(index).best[0] for index in state.members}
        if turned == state.members:
            break
        state = State(turned, state.evidence)
    return state


def refined(state: State) -> State:
    """With the number of every family between those of its grid, where that is coarse."""
    for index in state.members:
        state = _refined(state, index)
    return state


def _refined(state: State, index: int) -> State:
    evidence, hypothesis = state.evidence, state.evidence.design.hypotheses[index]
    if hypothesis.free or len(hypothesis.numbers) < 2:
        return state
    table = state.table(index)
    highest = table.logs.max(axis=1)
    numbers = np.log([evidence.design.blocks[block].number for block in table.blocks])
    order = np.argsort(numbers)
    best = int(np.flatnonzero(order == np.argmax(highest))[0])
    around = order[max(best - 1, 0) : best + 2]
    if len(around) < 3 or highest[order[best]] - highest[around].min() < NEAR:
        return state
    others = state.without(index)

    def value(number: float) -> float:
        rows = [one.rows(hypothesis.series(one, math.exp(number))) for one in evidence.design.observations]
        size = math.sqrt(sum(float(np.sum(part**2)) for part in rows) / rows[0].shape[1] / evidence.design.count)
        return -evidence.trial([part / size for part in rows], others)

    low, high = float(numbers[around[0]]), float(numbers[around[-1]])
    found = optimize.minimize_scalar(value, bounds=(low, high), method="bounded", options={"xatol": (high - low) / 200})
    step = (high - low) / 40
    bend = (value(found.x - step) + value(found.x + step) - 2 * found.fun) / step**2
    width = math.sqrt(2 * math.pi / max(bend, 1.0 / (high - low) ** 2))
    weight = math.log(min(width, (high - low) / 2) / float(np.ptp(numbers)))
    design = evidence.design.with_number(index, math.exp(found.x), weight)
    whiteners = evidence.whiteners
    members = {**state.members, index: Member(len(design.blocks) - 1, state.members[index].scale)}
    return State(members, Evidence(design, whiteners, evidence.led))


def _scaled(
    response: Callable[[Array, float], NDArray[np.complex128]], number: float, coefficient: float, angular: Array
) -> NDArray[np.complex128]:
    return coefficient * response(angular, number)


def _nearby(drift: Drift) -> list[Drift]:
    """The same, as much of it as is next to it, and none."""
    if not drift.power:
        return [NONE]
    at = POWERS.index(drift.power)
    return [drift, *(replace(drift, power=power) for power in POWERS[max(at - 2, 0) : at]), NONE]


def price_of(count: int) -> float:
    """Log odds against one of so many hypotheses, half of all machines lacking something."""
    return math.log(count)

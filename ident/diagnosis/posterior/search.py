"""The search: sets of hypotheses, one after the other, each with the noise that it leaves."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.posterior.bends import Bends, Bent, Form
from ident.diagnosis.posterior.evidence import Evidence, Member, Members, Products, Table, Target
from ident.diagnosis.posterior.hypotheses import Block, Design
from ident.diagnosis.posterior.noise import Colours, Sizes, most_likely, price_of

Array = NDArray[np.float64]

SWEEPS: Final = 4
"""Times that the numbers of all members are chosen anew, each beside the others, and what their columns miss."""

SETTLED: Final = 0.1
"""Change of the log posterior from which that has settled."""

MOST: Final = 4
"""Members of a set."""

INSTEAD: Final = 2
"""Names that may stand for a law."""

SURVIVORS: Final = 5
"""Hypotheses that are fitted exactly at every step."""

TELLING: Final = 5.0
"""Standard deviations of a coefficient from which numbers that its column was made for are moved."""

FURTHEST: Final = 0.3
"""Share of a held number that it is moved by at once."""

DISTINCT: Final = 0.02
"""Power of a column that must be left beside the members: columns are exact to about a hundredth."""

SURELY: Final = 3.0
"""Log posterior by which a law must be better than names to stand in their place: twenty to one."""

MARGIN: Final = 4.0
"""Log posterior below the best one's from which a hypothesis is not fitted exactly."""


@dataclass(frozen=True)
class State:
    """A set of hypotheses.

    Attributes:
        members: by number.
        bends: what the columns of a member miss of it, by number.
        evidence: with the noise that is most likely beside them.
    """

    members: Members
    bends: Mapping[int, Bent]
    evidence: Evidence

    @cached_property
    def target(self) -> Target:
        """The rows without what columns miss."""
        return self.evidence.target_beside(self.bends.values())

    @cached_property
    def log_posterior(self) -> float:
        """But for a constant."""
        tables = {index: self.table(index) for index in self.members}
        if not all(table.is_there for table in tables.values()):
            return -math.inf
        hypotheses = self.evidence.design.hypotheses
        inside = sum(table.inside for table in tables.values())
        price = sum(hypotheses[index].price for index in self.members) + price_of(self.evidence.sizes)
        return self.target.nothing + self.target.log_likelihood(self.members) + inside - price

    def table(self, hypothesis: int) -> Table:
        """Evidence of a member beside the others, by its slopes where it has them: those are of one block."""
        only = self.members[hypothesis].block if hypothesis in self.bends else None
        return self.target.table_of(hypothesis, self.without(hypothesis), only)

    def tables(self) -> dict[int, Table]:
        """Evidence of all other hypotheses beside the members, but of those that are the same as some of these."""
        beside, hypotheses = self.target.beside(self.members), self.evidence.design.hypotheses
        left = np.diag(beside) / np.maximum(np.diag(self.target.products), np.finfo(float).tiny)
        return {
            index: self.target.table(index, beside)
            for index, one in enumerate(hypotheses)
            if index not in self.members and any(left[block.place].max() > DISTINCT for block in one.blocks)
        }

    def without(self, hypothesis: int) -> dict[int, Member]:
        """The other members."""
        return {index: one for index, one in self.members.items() if index != hypothesis}


class Search:
    """Looks for the set of hypotheses with the largest posterior.

    Args:
        design: of the rows.
        colours: of their noise.
        bends: of the hypotheses.
    """

    def __init__(self, design: Design, colours: Colours, bends: Bends) -> None:
        self.design, self.colours, self.bends = design, colours, bends
        self._products = Products(design, colours)
        self._kept: dict[frozenset[int], State] = {}
        self._evidence: dict[Sizes, Evidence] = {}

    def run(self) -> State:
        """The best set that was found."""
        state = self.nothing
        while len(state.members) < MOST:
            further = max(self._expanded(state), key=lambda one: one.log_posterior, default=state)
            further = self._pruned(further)
            if further.log_posterior <= state.log_posterior:
                break
            state = further
        return self._named(self.against_rivals(state))

    def against_rivals(self, state: State) -> State:
        """With the best hypothesis in the place of every member."""
        for _ in range(SWEEPS):
            before = state
            for index in before.members:
                bare = self.state(before.without(index), before)
                state = max(state, *self._expanded(bare), key=lambda one: one.log_posterior)
            if state is before:
                break
        return state

    @property
    def nothing(self) -> State:
        """No hypothesis at all."""
        return self.state({}, None)

    def state(self, members: Members, before: State | None) -> State:
        """A set, its members' numbers fitted by turns, with the noise that they leave.

        Args:
            members: to begin with.
            before: a set that is nearly the same, whose noise is taken first.
        """
        key = frozenset(members)
        if key not in self._kept:
            start = self.colours.usual if before is None else before.evidence.sizes
            bends = {} if before is None else {index: bend for index, bend in before.bends.items() if index in members}
            found = self._settled(State(members, bends, self._evidence_with(start)))
            for _ in range(SWEEPS):
                noise = self._noise_beside(found)
                if noise == found.evidence.sizes:
                    break
                found = self._settled(replace(found, evidence=self._evidence_with(noise)))
            self._kept[key] = found
        return self._kept[key]

    def _evidence_with(self, sizes: Sizes) -> Evidence:
        if sizes not in self._evidence:
            self._evidence[sizes] = Evidence(self._products, sizes)
        return self._evidence[sizes]

    def _noise_beside(self, state: State) -> Sizes:
        """What is most likely lacking beside a set."""
        hypotheses, columns, expected = self.design.hypotheses, [self.design.baseline], list[tuple[Array, Array]]()
        end = self.design.baseline.shape[1]
        for index, one in state.members.items():
            block, bent = hypotheses[index].blocks[one.block], state.bends.get(index)
            factor = one.scale * block.factor
            columns.append(self._columns(state, index, one))
            if bent is not None:
                slopes, target = bent.expected
                rows = np.zeros((len(target), end + factor.shape[1]))
                rows[:, end:] = slopes @ factor
                expected.append((rows, target))
            end += factor.shape[1]
        known = np.zeros((end + 1, end + 1))
        for rows, target in expected:
            whole = np.column_stack([np.pad(rows, ((0, 0), (0, end - rows.shape[1]))), target])
            known += whole.T @ whole
        target = self.design.target - sum((bent.missed for bent in state.bends.values()), np.zeros(len(columns[0])))
        return most_likely(self.colours, np.hstack(columns), target, known, state.evidence.sizes)

    def _settled(self, state: State) -> State:
        """With the numbers of every member chosen anew, each beside the others, and what its columns miss."""
        before = -math.inf
        for _ in range(SWEEPS):
            for index in state.members:
                table = state.table(index)
                if not table.is_there:
                    return state
                state = replace(state, members={**state.members, index: table.best})
            state = self._bent(state)
            if abs(state.log_posterior - before) < SETTLED:
                break
            before = state.log_posterior
        return state

    def _bent(self, state: State) -> State:
        """With the exact forms of its members, about the numbers that they have."""
        means, hypotheses = state.target.means(state.members), self.design.hypotheses
        blocks = {index: hypotheses[index].blocks[one.block] for index, one in state.members.items()}
        if not any(self.bends.is_bent(hypotheses[index], block) for index, block in blocks.items()):
            return state
        parameters = state.evidence.parameters(self._added(state, blocks, means))
        forms = {
            index: self.bends.form(hypotheses[index], block, parameters)
            for index, block in blocks.items()
            if self.bends.is_bent(hypotheses[index], block)
        }
        before = {index: state.bends[index].held if index in state.bends else None for index in forms}
        found = {index: self.bends.bend(form, means[index], before[index]) for index, form in forms.items()}
        state = replace(state, bends={index: bent for index, bent in found.items() if bent is not None})
        for index, form in forms.items():
            if float(np.abs(means[index]).max()) > self._telling:
                state = self._moved(state, index, form, means[index])
        return state

    @property
    def _telling(self) -> float:
        """Coefficient of a column of unit rms from which held numbers show: they turn a tenth of it."""
        return TELLING / math.sqrt(len(self.design.target))

    def _moved(self, state: State, index: int, form: Form, mean: Array) -> State:
        """With the held numbers of a member moved to where the rows want them, if that is better."""
        bent = state.bends.get(index) or self.bends.bend(form, mean, form.held(mean))
        if bent is None or not bent.held.size:
            return state
        others = {one: member for one, member in state.members.items() if one != index}
        step = self._step(replace(state, bends={**state.bends, index: bent}), others, form, bent)
        moved = self.bends.bend(form, mean, bent.held + step)
        better = state if moved is None else replace(state, bends={**state.bends, index: moved})
        return max(state, better, key=lambda one: one.log_posterior)

    def _step(self, state: State, others: Members, form: Form, bent: Bent) -> Array:
        """(H,) of the held numbers of a member, everything else fitted beside."""
        free, expected = form.held_slopes(bent), form.expected_of_held(bent)
        columns = [self.design.baseline, *(self._columns(state, index, one) for index, one in others.items())]
        missed = sum((one.missed for one in state.bends.values()), np.zeros(len(free)))
        whole = np.column_stack([*columns, bent.slopes, free, self.design.target - missed])
        white, _ = self.colours.white(whole, state.evidence.sizes)
        width, size = sum(one.shape[1] for one in columns), np.linalg.norm(white[:, -1 - free.shape[1] : -1], axis=0)
        scale = np.concatenate([np.ones(white.shape[1] - 1 - len(size)), 1 / np.maximum(size, np.finfo(float).tiny)])
        own = np.zeros((len(bent.expected[1]), len(scale)))
        own[:, width : width + bent.slopes.shape[1]], own[:, -len(size) :] = bent.expected[0], expected
        ridge = np.eye(len(scale))[:width]
        rows = np.vstack([white[:, :-1] * scale, own * scale, ridge])
        target = np.concatenate([white[:, -1], bent.expected[1], np.zeros(width)])
        found = np.linalg.lstsq(rows, target, rcond=None)[0] * scale
        most = FURTHEST * np.maximum(np.abs(bent.held), FURTHEST)
        return np.asarray(np.clip(found[-len(size) :], -most, most))

    def _columns(self, state: State, index: int, member: Member) -> Array:
        """(n, R) of a member, of unit variance."""
        block, bent = self.design.hypotheses[index].blocks[member.block], state.bends.get(index)
        columns = self.design.columns[:, block.place] if bent is None else bent.slopes
        return np.asarray(columns @ (member.scale * block.factor))

    def _added(self, state: State, blocks: Mapping[int, Block], means: Mapping[int, Array]) -> Array:
        """(n,) what the members add."""
        found = np.zeros(len(self.design.target))
        for index, block in blocks.items():
            bent = state.bends.get(index)
            if bent is None:
                found += self.design.columns[:, block.place] @ means[index]
            else:
                found += bent.slopes @ means[index] + bent.missed
        return found

    def _expanded(self, state: State, *, named: bool = False) -> Sequence[State]:
        """Sets with one member more, of those that promise most; or of those alone that have a name."""
        return [
            self.state({**state.members, index: one}, state) for index, one in self._promising(state, named).items()
        ]

    def _promising(self, state: State, named: bool) -> dict[int, Member]:
        """Hypotheses by the noise that is left, and by that of which nothing is lacking.

        What a model lacks may be as large as what is looked for, and hide it.
        """
        hypotheses = self.design.hypotheses
        usual = replace(state, evidence=self._evidence_with(self.colours.usual))
        found: dict[int, Member] = {}
        for one in (state, usual) if usual.evidence is not state.evidence else (state,):
            tables = {
                index: table
                for index, table in one.tables().items()
                if table.is_there and not (named and hypotheses[index].free)
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
            fewer = [self.state(state.without(index), state) for index in state.members]
            best = max(fewer, key=lambda one: one.log_posterior)
            if best.log_posterior < state.log_posterior:
                break
            state = best
        return state

    def _named(self, state: State) -> State:
        """With names in the place of every law that is not surely better."""
        for index in [one for one in state.members if self.design.hypotheses[one].free]:
            instead = self.state(state.without(index), state)
            for _ in range(INSTEAD):
                further = self._expanded(instead, named=True)
                instead = max(further, key=lambda one: one.log_posterior, default=instead)
                if instead.log_posterior > state.log_posterior - SURELY:
                    state = instead
                    break
        return state

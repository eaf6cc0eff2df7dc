"""A set of hypotheses, fitted: its numbers by turns, its exact forms about those, and the noise that it leaves."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import replace
from functools import cached_property, lru_cache, partial
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from ident.diagnosis.evidence.evidence import Evidence
from ident.diagnosis.evidence.misfit import scatter_along, tempered
from ident.diagnosis.evidence.state import State
from ident.diagnosis.evidence.tables import Member, Members
from ident.diagnosis.hypotheses.bends import Bends, Bent, Form
from ident.diagnosis.hypotheses.hypotheses import Block, Design
from ident.diagnosis.hypotheses.products import Products, numbers_of
from ident.diagnosis.noise.colours import Colours, Sizes, most_likely
from ident.diagnosis.observations.directions import VISIBLE
from ident.diagnosis.observations.linear import RANK, with_known
from ident.diagnosis.observations.whitening import Left
from ident.diagnosis.problem import Series, summed

Array = NDArray[np.float64]

SWEEPS: Final = 4
"""Times that the numbers of all members are chosen anew, each beside the others, and that their noise is."""

SETTLED: Final = 0.1
"""Change of the log posterior from which that has settled."""

TELLING: Final = 5.0
"""Standard deviations of a coefficient from which numbers that its column was made for are moved."""

FURTHEST: Final = 0.3
"""Share of a held number that it is moved by at once, or of one where it is zero: a phase, a share."""


class Fitter:
    """Fits sets of hypotheses, each of them once.

    Args:
        design: of the rows.
        colours: of their noise.
        bends: exact forms of the hypotheses.
    """

    def __init__(self, design: Design, colours: Colours, bends: Bends) -> None:
        self.design, self._colours, self._bends = design, colours, bends
        self._all = Products(design, colours, np.arange(design.columns.shape[1]))
        self._kept: dict[tuple[frozenset[int], frozenset[int]], State] = {}
        # The last one alone, beside that of a complete model: they are large.
        self._of_all = lru_cache(maxsize=1)(partial(Evidence, self._all))

    @cached_property
    def _usual(self) -> Evidence:
        """Of all hypotheses, with the noise that is beside a complete model."""
        return Evidence(self._all, self._colours.usual)

    @cached_property
    def invisible(self) -> frozenset[int]:
        """Hypotheses of which the plant's parameters absorb all but nothing."""
        return frozenset(
            index
            for index, one in enumerate(self.design.hypotheses)
            if all(self._usual.shown[block.place].max() < VISIBLE**2 for block in one.blocks)
        )

    def among_all(self, state: State) -> State:
        """A set with the evidence of all hypotheses beside it."""
        sizes = state.evidence.sizes
        return replace(state, evidence=self._usual if sizes == self._usual.sizes else self._of_all(sizes))

    def with_nothing_lacking(self, state: State) -> State:
        """The same with the noise that is beside a complete model."""
        return replace(state, evidence=self._usual)

    @property
    def nothing(self) -> State:
        """No hypothesis at all."""
        return self.state({}, None)

    def is_bent(self, index: int, member: Member) -> bool:
        """Whether there is more to a member than its columns."""
        hypothesis = self.design.hypotheses[index]
        return self._bends.is_bent(hypothesis, hypothesis.blocks[member.block])

    def state(self, members: Members, before: State | None, resting: Collection[int] = ()) -> State:
        """A set, its members' numbers fitted by turns, with the noise that they leave.

        Args:
            members: to begin with.
            before: a set that is nearly the same, whose noise is taken first.
            resting: members whose held numbers are not moved from where they were there, or from those of the columns.
        """
        numbers, moved = frozenset(members), (frozenset(members), frozenset[int]())
        key = moved if moved in self._kept else (numbers, numbers & frozenset(resting))
        if key not in self._kept:
            start = self._colours.usual if before is None else before.evidence.sizes
            products = self._products(members)
            first = State(members, self._known(members, before), Evidence(products, start), key[1])
            found = self._from_both(first, any(bent.held.size for bent in first.bends.values()))
            for _ in range(SWEEPS):
                noise = self._noise_beside(found)
                if noise == found.evidence.sizes:
                    break
                anew = replace(found, evidence=Evidence(products, noise), resting=key[1])
                found = self._from_both(anew, False)
            self._kept[key] = found
            if not any(self.is_bent(index, found.members[index]) for index in key[1]):
                self._kept[moved] = found
        return self._kept[key]

    def _from_both(self, state: State, surely: bool) -> State:
        """Settled from the exact forms that it has, and from columns, surely or where there is no room for a member.

        Numbers of another set, or beside another noise, may lead elsewhere, or leave no room where columns do.
        """
        found = self._settled(state)
        if surely or not math.isfinite(found.log_posterior):
            found = max(found, self._settled(replace(state, bends={})), key=lambda one: one.log_posterior)
        return found

    def _known(self, members: Members, before: State | None) -> dict[int, Bent]:
        """Exact forms to begin with: of the set before, or those that were made last."""
        found = {}
        for index, one in members.items():
            hypothesis = self.design.hypotheses[index]
            known = None if before is None else before.bends.get(index)
            known = known or self._bends.last(hypothesis, hypothesis.blocks[one.block])
            if known is not None:
                found[index] = known
        return found

    def _products(self, members: Members) -> Products:
        """Of the columns of some hypotheses alone."""
        blocks = [block for index in members for block in self.design.hypotheses[index].blocks]
        columns = [np.zeros(0, dtype=np.int64), *(numbers_of(one.place) for one in blocks)]
        return Products(self.design, self._colours, np.unique(np.concatenate(columns)))

    def _noise_beside(self, state: State) -> Sizes:
        """What is most likely lacking beside a set."""
        columns, target, beside = self.rows_of(state)
        known = np.column_stack(beside)
        return most_likely(self._colours, columns, target, known.T @ known, state.evidence.sizes)

    def rows_of(self, state: State) -> tuple[Array, Array, tuple[Array, Array]]:
        """Columns (n, k) of the plant and of all members, the target (n,), and rows of what is expected beside."""
        members = state.members.items()
        columns = np.hstack([self.design.baseline, *(self._columns(state, index, one) for index, one in members)])
        expected = self._expected_beside(state, state.members, columns.shape[1])
        return columns, self.design.target - state.missed, expected

    def left(self, state: State) -> Left:
        """What a set leaves of the rows."""
        columns, target, known = self.rows_of(state)
        white, _ = self._colours.white(np.column_stack([columns, target]), state.evidence.sizes)
        rows, wanted = with_known(white[:, :-1], white[:, -1], known)
        directions, factor = np.linalg.qr(rows)
        found = linalg.solve_triangular(factor, directions.T @ wanted)
        # Coefficients that are known beforehand as well as the rows say are no free ones.
        return Left(target - columns @ found, float(np.sum(directions[: len(target)] ** 2)))

    def excess(self, state: State, chosen: NDArray[np.bool_] | slice = slice(None)) -> dict[int, float]:
        """How far rows scatter beyond their noise along every member, by which its likelihoods are tempered.

        Args:
            state: the set.
            chosen: (n,) rows that are looked at; all of them.
        """
        columns, target, expected = self.rows_of(state)
        white, _ = self._colours.white(np.column_stack([columns, target]), state.evidence.sizes)
        white, stretch, places = white[chosen], self._colours.stretch[chosen], self._places(state.members)
        scatters = scatter_along(white[:, :-1], white[:, -1], expected, stretch, list(places.values()))
        return {index: one.excess for index, one in zip(places, scatters, strict=True)}

    def odds(self, state: State, index: int, bare: State) -> float:
        """Log odds of a member against nothing in its place, evidence tempered; `bare` is the set without it."""
        return tempered(state.log_posterior - bare.log_posterior, state.cost(index), self.excess(state)[index])

    def _places(self, members: Members) -> dict[int, slice]:
        """Where coefficients of members stand behind those of the baseline."""
        found, end = dict[int, slice](), self.design.baseline.shape[1]
        for index, one in members.items():
            width = self.design.hypotheses[index].blocks[one.block].factor.shape[1]
            found[index], end = slice(end, end + width), end + width
        return found

    def _settled(self, state: State) -> State:
        """With the numbers of every member chosen anew, each beside the others, and what its columns miss."""
        before = -math.inf
        for _ in range(SWEEPS):
            for index in state.members:
                table = state.table(index)
                if not table.is_there:
                    return state
                state = state.with_members({**state.members, index: table.best})
            state = self._bent(state)
            if abs(state.log_posterior - before) < SETTLED:
                break
            before = state.log_posterior
        return state

    def _bent(self, state: State) -> State:
        """With the exact forms of its members, about the numbers that they have."""
        means, hypotheses = state.target.means(state.members), self.design.hypotheses
        blocks = {index: hypotheses[index].blocks[one.block] for index, one in state.members.items()}
        bent_ones = [index for index, block in blocks.items() if self._bends.is_bent(hypotheses[index], block)]
        if not bent_ones:
            return state
        parameters = self._parameters(state, blocks, means)
        forces = self._forces(state, blocks, means, parameters)
        forms = {
            index: self._bends.form(
                hypotheses[index], blocks[index], parameters, forces if self._bends.turns(hypotheses[index]) else ()
            )
            for index in bent_ones
        }
        before = {index: state.bends[index].held if index in state.bends else None for index in forms}
        found = {index: self._bends.bend(form, means[index], before[index]) for index, form in forms.items()}
        state = replace(state, bends={index: bent for index, bent in found.items() if bent is not None})
        for index, form in forms.items():
            if index not in state.resting and self._is_telling(state, blocks[index], means[index]):
                state = self._moved(state, index, form, means[index])
        return state

    def _forces(
        self, state: State, blocks: Mapping[int, Block], means: Mapping[int, Array], parameters: Array
    ) -> Series:
        """Of the members that turn nothing, where there are some that do; those do not turn each other.

        A law has none: it is known in the rows alone.
        """
        hypotheses, parts = self.design.hypotheses, list[Series]()
        if any(self._bends.turns(hypotheses[index]) for index in blocks):
            for index, block in blocks.items():
                if not (hypotheses[index].free or self._bends.turns(hypotheses[index])):
                    form, bent = self._bends.form(hypotheses[index], block, parameters), state.bends.get(index)
                    if form.has_force:
                        parts.append(form.force(means[index], np.zeros(0) if bent is None else bent.held))
        return summed(parts) if parts else ()

    @staticmethod
    def _is_telling(state: State, block: Block, mean: Array) -> bool:
        """Whether held numbers show: they turn a tenth of a coefficient."""
        place = state.evidence.products.at(block.place)
        deviations = np.abs(mean) * np.sqrt(np.maximum(state.target.products.diagonal[place], 0.0))
        return float(deviations.max()) > TELLING

    def _moved(self, state: State, index: int, form: Form, mean: Array) -> State:
        """With the held numbers of a member moved to where the rows want them, if that is better."""
        bent = state.bends.get(index) or self._bends.bend(form, mean, form.held(mean))
        rested = replace(state, resting=state.resting | {index})
        if bent is None or not bent.held.size:
            return rested
        step, gain = self._step(replace(state, bends={**state.bends, index: bent}), state.without(index), form, bent)
        if gain < SETTLED:
            return rested
        moved = self._bends.bend(form, mean, bent.held + step)
        better = state if moved is None else replace(state, bends={**state.bends, index: moved})
        return better if better.log_posterior > state.log_posterior + SETTLED else rested

    def _step(self, state: State, others: Members, form: Form, bent: Bent) -> tuple[Array, float]:
        """(H,) of the held numbers of a member, everything else fitted beside, and the log posterior that it promises.

        At most `FURTHEST` at once; what is promised is by the whole of it.
        """
        free, expected = form.held_slopes(bent)
        columns = [self.design.baseline, *(self._columns(state, index, one) for index, one in others.items())]
        whole = np.column_stack([*columns, bent.slopes, free, self.design.target - state.missed])
        white, _ = self._colours.white(whole, state.evidence.sizes)
        width, size = sum(one.shape[1] for one in columns), np.linalg.norm(white[:, -1 - free.shape[1] : -1], axis=0)
        scale = np.concatenate([np.ones(white.shape[1] - 1 - len(size)), 1 / np.maximum(size, np.finfo(float).tiny)])
        own = np.zeros((len(bent.expected[1]), len(scale)))
        own[:, width : width + bent.slopes.shape[1]], own[:, -len(size) :] = bent.expected[0], expected
        beside, wanted = self._expected_beside(state, others, len(scale))
        # What cannot be told from others promises nothing.
        prior = np.diag(np.where(np.arange(len(scale)) < width, 1.0, RANK))
        rows = np.vstack([white[:, :-1] * scale, own * scale, beside, prior])
        target = np.concatenate([white[:, -1], bent.expected[1], wanted, np.zeros(len(scale))])
        # What is left of their columns beside all others, and what the rows want of that.
        factor = np.linalg.qr(np.column_stack([rows, target])).R[-1 - len(size) : -1, -1 - len(size) :]
        wished = linalg.solve_triangular(factor[:, :-1], factor[:, -1])
        most = FURTHEST * _range(bent.held)
        return np.clip(wished * scale[-len(size) :], -most, most), 0.5 * float(np.sum(factor[:, -1] ** 2))

    def _expected_beside(self, state: State, members: Members, count: int) -> tuple[Array, Array]:
        """Rows (m, count) and (m,) of what is expected of members that stand behind the baseline."""
        rows, targets = [np.zeros((0, count))], [np.zeros(0)]
        for index, place in self._places(members).items():
            if index in state.bends:
                one, (slopes, target) = members[index], state.bends[index].expected
                part = np.zeros((len(target), count))
                part[:, place] = slopes @ (one.scale * self.design.hypotheses[index].blocks[one.block].factor)
                rows.append(part)
                targets.append(target)
        return np.vstack(rows), np.concatenate(targets)

    def _columns(self, state: State, index: int, member: Member) -> Array:
        """(n, R) of a member, of unit variance."""
        block, bent = self.design.hypotheses[index].blocks[member.block], state.bends.get(index)
        columns = self.design.columns[:, block.place] if bent is None else bent.slopes
        return np.asarray(columns @ (member.scale * block.factor))

    def _parameters(self, state: State, blocks: Mapping[int, Block], means: Mapping[int, Array]) -> Array:
        """(p,) of the plant beside the members: those that are known as they are, the others fitted."""
        if not self.design.free.any():
            return self.design.known
        added = state.missed
        for index, block in blocks.items():
            bent = state.bends.get(index)
            added = added + (self.design.columns[:, block.place] if bent is None else bent.slopes) @ means[index]
        return state.evidence.parameters(added)


def _range(held: Array) -> Array:
    """(H,) what held numbers are measured by: themselves, or one where they are zero."""
    return np.where(held == 0, 1.0, np.abs(held))

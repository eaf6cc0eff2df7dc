"""Evidence: how much more likely rows are with hypotheses than without, all of their numbers integrated.

White rows are y = B θ + X a + ε, θ ~ N(0, 1) in what is known of the parameters, a ~ N(0, s² Φ Φᵀ). The scale s of a
cause is unknown by a factor: every one between what the rows could just show and far beyond is as likely (Jeffreys
1961). All of it is algebra of the products of columns: a hypothesis costs a small eigenproblem.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from ident.diagnosis.evidence.tables import Member, Members, Table, tables_of
from ident.diagnosis.hypotheses.bends import Bent
from ident.diagnosis.hypotheses.gram import Beside, Gram
from ident.diagnosis.hypotheses.hypotheses import Block
from ident.diagnosis.hypotheses.products import Products, among, numbers_of
from ident.diagnosis.noise.colours import Noise, Sizes

Array = NDArray[np.float64]

OCTAVES: Final = 1.0
"""Between neighbouring scales, in doublings: the evidence of one is that of the other but for a tenth."""

LARGEST: Final = 100.0
"""Scale, in units of the noise, that is tried at most."""


class Evidence:
    """The evidence of all hypotheses with one noise.

    Args:
        products: of the rows.
        sizes: of what is lacking.

    Attributes:
        shown: (k,) power of every column beside the plant's parameters, over its own.
    """

    def __init__(self, products: Products, sizes: Sizes) -> None:
        self.design, self.products, self.sizes = products.design, products, sizes
        whole, self._volume = products.summed(sizes)
        width = self.design.baseline.shape[1]
        self._baseline = linalg.cho_factor(np.eye(width) + whole[:width, :width])
        self._across = linalg.cho_solve(self._baseline, whole[:width, width:])
        self._beside = whole[width:, width:] - whole[:width, width:].T @ self._across
        power = np.maximum(np.diag(whole)[width:-1], np.finfo(float).tiny)
        self.shown: Array = np.diag(self._beside)[:-1] / power
        self._determinant = float(np.sum(np.log(np.diag(self._baseline[0]))))
        smallest = 1 / math.sqrt(len(self.design.target))
        self._alone = dict[int, Table]()
        self.scales = np.geomspace(smallest, LARGEST, 1 + math.ceil(math.log2(LARGEST / smallest) / OCTAVES))

    @property
    def noise(self) -> Noise:
        """Of the rows."""
        return Noise(self.products.colours, self.sizes)

    def target_beside(self, bends: Collection[Bent]) -> Target:
        """The rows, some members by their slopes instead of their columns, with what is expected of those."""
        found = self._bent(bends) if bends else Gram.of_all(self._beside)
        return Target(self, found, -0.5 * float(found.target[-1]) - self._volume - self._determinant)

    @cached_property
    def _plain(self) -> Beside:
        """All columns beside nothing; what is large here holds nothing that holds it, and goes when it is not asked."""
        return Beside.beside_nothing(Gram.of_all(self._beside))

    def alone(self, hypothesis: int) -> Table:
        """Log evidence of a hypothesis beside nothing, and beside what acts in other rows."""
        if hypothesis not in self._alone:
            (self._alone[hypothesis],) = self.tables_by([self.design.hypotheses[hypothesis].blocks], self._plain)
        return self._alone[hypothesis]

    def tables_by(self, blocks: Sequence[Sequence[Block]], products: Beside) -> list[Table]:
        """Of hypotheses that have these blocks, whose numbers in the tables are their places here."""
        return tables_of(blocks, self.products.at, products, self.scales, len(self.design.target))

    def parameters(self, added: Array) -> Array:
        """(p,) of the plant beside what some members add (n,), in their units; those that are known as they are."""
        along, _ = self.products.with_others(self.sizes, (self.design.target - added)[:, None])
        own = linalg.cho_solve(self._baseline, along[: len(self._across), 0])
        return np.asarray(self.design.known + np.where(self.design.free, self.design.spread @ own, 0.0))

    def _bent(self, bends: Collection[Bent]) -> Gram:
        width = len(self._across)
        others = np.column_stack([*(bent.slopes for bent in bends), sum(bent.missed for bent in bends)])
        along, own = self.products.with_others(self.sizes, others)
        own = own - along[:width].T @ linalg.cho_solve(self._baseline, along[:width])
        rows = (along[width:] - self._across.T @ along[:width]).T
        replaced = np.concatenate([numbers_of(self.products.at(bent.place)) for bent in bends])
        # The target is what it was without what slopes miss.
        target = self._beside[:, -1] - rows[-1]
        target[replaced] = rows[:-1, -1] - own[:-1, -1]
        target[-1] += own[-1, -1] - rows[-1, -1]
        rows[:-1, replaced], rows[-1] = own[:-1, :-1], target
        rows[:-1, -1] = target[replaced]
        end = 0
        for bent in bends:
            place, (slopes, expected) = self.products.at(bent.place), bent.expected
            start, end = end, end + place.stop - place.start
            rows[start:end, place] += slopes.T @ slopes
            rows[start:end, -1] += slopes.T @ expected
            rows[-1, place] += slopes.T @ expected
            rows[-1, -1] += expected @ expected
        return Gram(self._beside, np.append(replaced, len(self._beside) - 1), rows)


@dataclass(frozen=True)
class Target:
    """Products of the columns of some hypotheses, or of all, and, last, of a target; the baseline integrated.

    Attributes:
        evidence: of which noise.
        products: of them.
        nothing: log likelihood without any hypothesis.
    """

    evidence: Evidence
    products: Gram
    nothing: float

    def beside(self, members: Members) -> Beside:
        """The products of columns and of the target, members integrated."""
        if not members:
            return Beside.beside_nothing(self.products)
        own, rows = self._stacked(members)
        powers, directions = self._directions(own, rows)
        return Beside(self.products, self.products.columns(rows) @ directions, powers)

    def log_likelihood(self, members: Members) -> float:
        """With members of these numbers, against none."""
        if not members:
            return 0.0
        own, rows = self._stacked(members)
        powers, directions = self._directions(own, rows)
        amplitudes = directions.T @ self.products.target[rows]
        return 0.5 * float(np.sum(amplitudes**2 / (1 + powers) - np.log1p(powers)))

    def means(self, members: Members) -> dict[int, Array]:
        """Coefficients (K,) of the columns of every member."""
        if not members:
            return {}
        own, rows = self._stacked(members)
        powers, directions = self._directions(own, rows)
        mean = np.zeros(len(self.products) - 1)
        mean[rows] = directions @ (directions.T @ self.products.target[rows] / (1 + powers))
        return {index: mean[self._place(index, one)] for index, one in members.items()}

    def _directions(self, own: Array, rows: NDArray[np.int64]) -> tuple[Array, Array]:
        """Powers (R,) of independent combinations of unit variance, and these (r, R), by factors of members (r, R)."""
        powers, turn = np.linalg.eigh(own.T @ self.products.among(rows) @ own)
        # Columns that are the same but for rounding have no power apart.
        return np.maximum(powers, 0.0), own @ turn

    def table_of(self, hypothesis: int, others: Members, only: int | None = None) -> Table:
        """Log evidence of a hypothesis, or of one of its blocks alone, beside others."""
        if only is None:
            return self.table(hypothesis, self.beside(others))
        # What is expected of it stands in its products already.
        block = replace(self.evidence.design.hypotheses[hypothesis].blocks[only], expected=None)
        (table,) = self.evidence.tables_by([[block]], self.beside(others))
        return replace(table, blocks=(only,))

    def table(self, hypothesis: int, products: Beside) -> Table:
        """The same, by the products of all columns beside the others."""
        return self.tables([hypothesis], products)[hypothesis]

    def tables(self, hypotheses: Sequence[int], products: Beside) -> dict[int, Table]:
        """Of some hypotheses, all together; what the others do not touch has been looked at before."""
        at, every = self.evidence.products.at, self.evidence.design.hypotheses
        alone = {
            one for one in hypotheses if all(products.untouched[at(block.place)].all() for block in every[one].blocks)
        }
        made = self.evidence.tables_by([every[one].blocks for one in hypotheses if one not in alone], products)
        rest = iter(made)
        return {one: self.evidence.alone(one) if one in alone else next(rest) for one in hypotheses}

    def _block(self, index: int, member: Member) -> Block:
        return self.evidence.design.hypotheses[index].blocks[member.block]

    def _place(self, index: int, member: Member) -> slice:
        return self.evidence.products.at(self._block(index, member).place)

    def _stacked(self, members: Members) -> tuple[Array, NDArray[np.int64]]:
        """(r, R) factors of all members beside each other, and the columns (r,) that they have."""
        places = [self._place(index, one) for index, one in members.items()]
        columns = np.unique(np.concatenate([numbers_of(place) for place in places]))
        parts = []
        for place, (index, one) in zip(places, members.items(), strict=True):
            factor = self._block(index, one).factor
            part = np.zeros((len(columns), factor.shape[1]))
            part[among(columns, place)] = one.scale * factor
            parts.append(part)
        return np.hstack(parts), columns

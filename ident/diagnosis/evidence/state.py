"""A set of hypotheses with its numbers and its noise, and how likely it is."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.evidence.evidence import Evidence, Target
from ident.diagnosis.evidence.tables import Member, Members, Table
from ident.diagnosis.hypotheses.bends import Bent
from ident.diagnosis.noise.colours import price_of

Array = NDArray[np.float64]

DISTINCT: Final = 0.02
"""Power of a column that must be left beside the members: columns are exact to about a hundredth."""


@dataclass(frozen=True)
class State:
    """A set of hypotheses.

    Attributes:
        members: by number.
        bends: what the columns of a member miss of it, by number.
        evidence: with the noise that is most likely beside them.
        resting: members whose held numbers are where the rows want them, or are not to be moved.
    """

    members: Members
    bends: Mapping[int, Bent]
    evidence: Evidence
    resting: frozenset[int] = frozenset()

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

    def with_members(self, members: Members) -> State:
        """Other numbers of the same hypotheses, beside the same exact forms."""
        found = replace(self, members=members)
        found.__dict__["target"], found.__dict__["_made"] = self.target, self._made
        return found

    @property
    def missed(self) -> Array:
        """(n,) of the target, what neither the columns nor the slopes of its members have."""
        return sum((bent.missed for bent in self.bends.values()), np.zeros(len(self.evidence.design.target)))

    def table(self, hypothesis: int) -> Table:
        """Evidence of a member beside the others, by its slopes where it has them: those are of one block."""
        only = self.members[hypothesis].block if hypothesis in self.bends else None
        others = self.without(hypothesis)
        key = hypothesis, only, tuple(others.items())
        if key not in self._made:
            self._made[key] = self.target.table_of(hypothesis, others, only)
        return self._made[key]

    @cached_property
    def _made(self) -> dict[tuple[int, int | None, tuple[tuple[int, Member], ...]], Table]:
        """Tables of members beside others; exact forms and noise are the same for all that share it."""
        return {}

    def cost(self, hypothesis: int) -> float:
        """What integrating the numbers of a member costs, and its choice."""
        return self.table(hypothesis).cost + self.evidence.design.hypotheses[hypothesis].price

    def tables(self) -> dict[int, Table]:
        """Evidence of all other hypotheses beside the members, but of those that are the same as some of these.

        For a set with the evidence of all.
        """
        beside, hypotheses = self.target.beside(self.members), self.evidence.design.hypotheses
        left = beside.diagonal / np.maximum(self.target.products.diagonal, np.finfo(float).tiny)
        others = [
            index
            for index, one in enumerate(hypotheses)
            if index not in self.members and any(left[block.place].max() > DISTINCT for block in one.blocks)
        ]
        return self.target.tables(others, beside)

    def without(self, hypothesis: int) -> dict[int, Member]:
        """The other members."""
        return {index: one for index, one in self.members.items() if index != hypothesis}

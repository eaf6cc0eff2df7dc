"""The design: rows of all records, and the columns that plant and hypotheses have in them, before any noise."""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.core.hypotheses import Hypothesis, following
from ident.diagnosis.core.observations import Observation, plant_columns, rates_of

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Block:
    """Columns of one hypothesis at one number.

    Attributes:
        hypothesis: its number among all.
        number: of the family, or length of the function.
        place: among all columns of the design.
        factor: (K, R) of the prior of the columns.
        weight: log of the prior mass that it stands for.
    """

    hypothesis: int
    number: float
    place: slice
    factor: Array
    weight: float


class Design:
    """Rows of all records and of all hypotheses, before any noise.

    Attributes:
        plant: (n, p) of every record.
        columns: (n, K) of every record, of unit rms over all of them.
        sizes: (K,) what they were divided by.
        blocks: which columns are whose.
    """

    def __init__(self, observations: Sequence[Observation], hypotheses: Sequence[Hypothesis]) -> None:
        self.observations, self.hypotheses = observations, hypotheses
        self.rates = rates_of(observations)
        self.plant = [plant_columns(one, self.rates) for one in observations]
        self.width = self.plant[0].shape[1]
        self.following = [one.rows(following(one)) for one in observations]
        self.targets = [one.target for one in observations]
        self.count = sum(len(one) for one in observations)
        self.effort = math.sqrt(sum(float(np.sum(one.rows(one.effort) ** 2)) for one in observations) / self.count)
        self.columns = [np.zeros((len(one), 0)) for one in observations]
        self.sizes = np.zeros(0)
        blocks = list[Block]()
        for index, hypothesis in enumerate(hypotheses):
            weight = -math.log(len(hypothesis.numbers))
            for number, value in enumerate(hypothesis.numbers.tolist()):
                if hypothesis.free and number:
                    blocks.append(replace(blocks[-1], number=value, factor=hypothesis.factors[number]))
                else:
                    blocks.append(self._appended(index, value, weight))
        self.blocks = tuple(blocks)
        for block in self.blocks:
            if hypotheses[block.hypothesis].free:
                self._normalise(block)

    def _appended(self, index: int, value: float, weight: float) -> Block:
        """Columns of a hypothesis at one more number."""
        hypothesis = self.hypotheses[index]
        rows = [one.rows(hypothesis.series(one, value)) for one in self.observations]
        sizes = np.sqrt(sum(np.sum(part**2, axis=0) for part in rows) / self.count)
        sizes[sizes == 0] = 1.0
        place = slice(len(self.sizes), len(self.sizes) + len(sizes))
        self.columns = [np.hstack([part, more / sizes]) for part, more in zip(self.columns, rows, strict=True)]
        self.sizes = np.append(self.sizes, sizes)
        factor = hypothesis.factors[0] if hypothesis.free else np.eye(len(sizes))
        return Block(index, value, place, factor, weight)

    def _normalise(self, block: Block) -> None:
        """A function has one unit: that in which what its own prior makes of the rows has unit rms."""
        raw = [part[:, block.place] * self.sizes[block.place] for part in self.columns]
        prior = sum(float(np.sum((part @ block.factor) ** 2)) for part in raw) / self.count
        self.sizes[block.place] = max(math.sqrt(prior), np.finfo(float).tiny)
        for part, whole in zip(self.columns, raw, strict=True):
            part[:, block.place] = whole / self.sizes[block.place]

    def with_number(self, index: int, value: float, weight: float) -> Design:
        """The same, one more number of a hypothesis being tried, of so much prior mass."""
        found = copy(self)
        found.blocks += (found._appended(index, value, weight),)
        return found

    def of(self, hypothesis: int) -> tuple[int, ...]:
        """Blocks of a hypothesis."""
        return tuple(index for index, block in enumerate(self.blocks) if block.hypothesis == hypothesis)

"""Evidence: how much more likely rows are with hypotheses than without, all of their numbers integrated.

Whitened rows are y = B θ + X a + ε, θ free, a ~ N(0, s² Φ Φᵀ). The scale s of a cause is unknown by a factor: every
one between what the record could just show, and all of the effort, is as likely (Jeffreys 1961). All of it is algebra
of the products of columns, so that a hypothesis costs a small eigenproblem, whatever the number of rows.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import linalg
from scipy.special import logsumexp

from ident.diagnosis.core.hypotheses import Hypothesis
from ident.diagnosis.core.noise import Whitener
from ident.diagnosis.core.observations import Observation

Array = NDArray[np.float64]

OCTAVES: Final = 1.0
"""Between neighbouring scales, in doublings: the evidence of one is that of the other but for a tenth."""


@dataclass(frozen=True)
class Block:
    """Columns of one hypothesis at one number.

    Attributes:
        hypothesis: its number among all.
        number: its place among the numbers of the family.
        place: among all columns of the design.
        factor: (K, R) of the prior of the columns.
    """

    hypothesis: int
    number: int
    place: slice
    factor: Array


@dataclass(frozen=True)
class Member:
    """A hypothesis that is taken, with the numbers that make its evidence largest: its block and its scale."""

    block: int
    scale: float


@dataclass(frozen=True)
class Table:
    """Log evidence of one hypothesis, beside others.

    Attributes:
        blocks: (G,) of its numbers.
        scales: (S,) tried.
        logs: (G, S) against its absence.
        total: of it, all of them integrated.
    """

    blocks: tuple[int, ...]
    scales: Array
    logs: Array

    @property
    def total(self) -> float:
        """Log evidence, numbers and scale integrated."""
        return float(logsumexp(self.logs) - math.log(self.logs.size))

    @property
    def best(self) -> tuple[Member, float]:
        """The numbers with the largest evidence, and that."""
        row, column = np.unravel_index(int(np.argmax(self.logs)), self.logs.shape)
        return Member(self.blocks[row], float(self.scales[column])), float(self.logs[row, column])


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
        self.plant = [np.column_stack([one.plant, one.late]) for one in observations]
        self.targets = [one.target for one in observations]
        pieces: list[list[Array]] = []
        blocks: list[Block] = []
        end = 0
        for index, hypothesis in enumerate(hypotheses):
            numbers = hypothesis.numbers[:1] if hypothesis.free else hypothesis.numbers
            for number, value in enumerate(numbers):
                rows = [one.rows(hypothesis.series(one, float(value))) for one in observations]
                pieces.append(rows)
                place = slice(end, end + rows[0].shape[1])
                if hypothesis.free:
                    blocks += [Block(index, n, place, factor) for n, factor in enumerate(hypothesis.factors)]
                else:
                    blocks.append(Block(index, number, place, np.eye(rows[0].shape[1])))
                end = place.stop
        self.columns = [np.hstack([rows[record] for rows in pieces]) for record in range(len(observations))]
        squares = sum(np.sum(part**2, axis=0) for part in self.columns)
        count = sum(len(one) for one in observations)
        self.sizes = np.sqrt(squares / count)
        self.sizes[self.sizes == 0] = 1.0
        for block in blocks:
            if hypotheses[block.hypothesis].free:
                # A function has one unit: what its own prior makes of the rows, of unit rms.
                prior = self.sizes[block.place] @ (block.factor**2) @ self.sizes[block.place]
                self.sizes[block.place] = max(math.sqrt(float(prior)), np.finfo(float).tiny)
        self.columns = [part / self.sizes for part in self.columns]
        self.blocks = tuple(blocks)
        self.effort = math.sqrt(sum(float(one.rows(one.effort) @ one.rows(one.effort)) for one in observations) / count)
        self.count = count

    def of(self, hypothesis: int) -> tuple[int, ...]:
        """Blocks of a hypothesis."""
        return tuple(index for index, block in enumerate(self.blocks) if block.hypothesis == hypothesis)


class Evidence:
    """The evidence of all hypotheses with one noise.

    Args:
        design: of the rows.
        whiteners: of every record.
        temperature: by which squares of the noise are larger than its own.
    """

    def __init__(self, design: Design, whiteners: Sequence[Whitener], temperature: float = 1.0) -> None:
        self.design, self.temperature = design, temperature
        white = [
            whitener.white(np.column_stack([plant, columns, target]))
            for whitener, plant, columns, target in zip(
                whiteners, design.plant, design.columns, design.targets, strict=True
            )
        ]
        self.white = np.vstack(white) / math.sqrt(temperature)
        floor = math.sqrt(float(np.mean([one.level for one in whiteners])))
        smallest = floor / math.sqrt(design.count)
        count = 1 + max(1, math.ceil(math.log2(max(design.effort / smallest, 2.0)) / OCTAVES))
        self.scales = np.geomspace(smallest, max(design.effort, 2 * smallest), count)

    @cached_property
    def _beside_plant(self) -> tuple[Array, float]:
        """Products of all columns and the target, the plant projected out."""
        width = self.design.plant[0].shape[1]
        basis = linalg.qr(self.white[:, :width], mode="economic")[0]
        left = self.white[:, width:] - basis @ (basis.T @ self.white[:, width:])
        return left.T @ left, float(left[:, -1] @ left[:, -1])

    def beside(self, members: Mapping[int, Member]) -> Array:
        """Products (K + 1, K + 1) of all columns and the target, members integrated, by hypothesis."""
        found, _ = self._beside_plant
        if not members:
            return found
        own, _ = self._stacked(members)
        inner = np.eye(own.shape[1]) + own.T @ found[:-1, :-1] @ own
        across = found[:, :-1] @ own
        return np.asarray(found - across @ linalg.solve(inner, across.T, assume_a="pos"))

    def _stacked(self, members: Mapping[int, Member]) -> tuple[Array, list[slice]]:
        """(K, R) factors of all members beside each other, and where each stands."""
        parts, places, end = [], [], 0
        for member in members.values():
            block = self.design.blocks[member.block]
            part = np.zeros((len(self.design.sizes), block.factor.shape[1]))
            part[block.place] = member.scale * block.factor
            parts.append(part)
            places.append(slice(end, end + part.shape[1]))
            end += part.shape[1]
        return np.hstack(parts), places

    def log_likelihood(self, members: Mapping[int, Member]) -> float:
        """Of the target with members of these numbers, against none."""
        found, _ = self._beside_plant
        if not members:
            return 0.0
        own, _ = self._stacked(members)
        inner = np.eye(own.shape[1]) + own.T @ found[:-1, :-1] @ own
        amplitude = own.T @ found[:-1, -1]
        factor = linalg.cho_factor(inner)
        gained = 0.5 * float(amplitude @ linalg.cho_solve(factor, amplitude))
        return gained - float(np.sum(np.log(np.diag(factor[0]))))

    def table(self, hypothesis: int, products: Array) -> Table:
        """Log evidence of a hypothesis over its numbers and scales.

        Args:
            hypothesis: its number.
            products: of `beside`.
        """
        own = self.design.of(hypothesis)
        logs = np.empty((len(own), len(self.scales)))
        for row, index in enumerate(own):
            block = self.design.blocks[index]
            inner = block.factor.T @ products[block.place, block.place] @ block.factor
            powers, turn = np.linalg.eigh(inner)
            amplitudes = turn.T @ (block.factor.T @ products[block.place, -1])
            powers = np.maximum(powers, 0.0)
            squares = self.scales[:, None] ** 2
            gains = squares / (1 + squares * powers)
            logs[row] = 0.5 * np.sum(gains * amplitudes**2 - np.log1p(squares * powers), axis=1)
        return Table(own, self.scales, logs)

    def coefficients(self, members: Mapping[int, Member]) -> dict[int, tuple[Array, Array]]:
        """Mean (K,) and covariance (K, K) of the columns of every member, of unit size, in the unit of the effort."""
        found, _ = self._beside_plant
        own, places = self._stacked(members)
        inner = np.eye(own.shape[1]) + own.T @ found[:-1, :-1] @ own
        covariance = linalg.inv(inner)
        mean = covariance @ (own.T @ found[:-1, -1])
        result = {}
        for (hypothesis, member), place in zip(members.items(), places, strict=True):
            block = self.design.blocks[member.block]
            turn = member.scale * block.factor
            result[hypothesis] = (turn @ mean[place], turn @ covariance[place, place] @ turn.T)
        return result

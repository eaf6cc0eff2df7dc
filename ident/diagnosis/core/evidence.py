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

from ident.diagnosis.core.hypotheses import Hypothesis, following
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
        rates = sorted({one.sample_time for one in observations})
        self.plant = [
            np.column_stack([one.plant, *(one.late * (one.sample_time == rate) for rate in rates)])
            for one in observations
        ]
        self.width = self.plant[0].shape[1]
        self.following = [one.rows(following(one)) for one in observations]
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
        led: whether the efforts follow what is reported as a filter of their lag does, and not later by it.
    """

    def __init__(self, design: Design, whiteners: Sequence[Whitener], led: bool = False) -> None:
        self.design, self.whiteners, self.led = design, tuple(whiteners), led
        white = [
            whitener.white(np.column_stack([plant, columns, target - follows if led else target]))
            for whitener, plant, columns, target, follows in zip(
                whiteners, design.plant, design.columns, design.targets, design.following, strict=True
            )
        ]
        self.white = np.vstack(white)
        self._volume = sum(
            float(np.sum(np.log(np.diag(one.factor)))) + 0.5 * len(one.factor) * math.log(one.level)
            for one in whiteners
        )
        floor = math.sqrt(float(np.mean([one.level for one in whiteners])))
        smallest = floor / math.sqrt(design.count)
        count = 1 + max(1, math.ceil(math.log2(max(design.effort / smallest, 2.0)) / OCTAVES))
        self.scales = np.geomspace(smallest, max(design.effort, 2 * smallest), count)

    @cached_property
    def _plant(self) -> tuple[Array, Array]:
        """Orthonormal basis of the plant's columns, and their triangle."""
        basis, triangle = linalg.qr(self.white[:, : self.design.width], mode="economic")
        return basis, triangle

    @cached_property
    def _products(self) -> Array:
        """Of all columns and the target, the plant projected out."""
        basis, _ = self._plant
        left = self.white[:, self.design.width :] - basis @ (basis.T @ self.white[:, self.design.width :])
        return np.asarray(left.T @ left)

    @cached_property
    def nothing(self) -> float:
        """Log likelihood of the rows without any hypothesis, the plant's parameters integrated."""
        triangle = np.abs(np.diag(self._plant[1]))
        return -0.5 * float(self._products[-1, -1]) - self._volume - float(np.sum(np.log(triangle)))

    def beside(self, members: Mapping[int, Member]) -> Array:
        """Products (K + 1, K + 1) of all columns and the target, members integrated, by hypothesis."""
        found = self._products
        if not members:
            return found
        own = self._stacked(members)
        inner = np.eye(own.shape[1]) + own.T @ found[:-1, :-1] @ own
        across = found[:, :-1] @ own
        return np.asarray(found - across @ linalg.solve(inner, across.T, assume_a="pos"))

    def _stacked(self, members: Mapping[int, Member]) -> Array:
        """(K, R) factors of all members beside each other."""
        parts = [np.zeros((len(self.design.sizes), 0))]
        for member in members.values():
            block = self.design.blocks[member.block]
            part = np.zeros((len(self.design.sizes), block.factor.shape[1]))
            part[block.place] = member.scale * block.factor
            parts.append(part)
        return np.hstack(parts)

    def log_likelihood(self, members: Mapping[int, Member]) -> float:
        """Of the target with members of these numbers, against none."""
        found = self._products
        if not members:
            return 0.0
        own = self._stacked(members)
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

    def plant_parameters(self, members: Mapping[int, Member]) -> tuple[Array, Array]:
        """Mean (p,) and covariance (p, p) of the plant's parameters, members integrated."""
        width = self.design.width
        whole = self.white.T @ self.white
        own = self._whole(members)
        inner = np.eye(own.shape[1]) + own.T @ whole @ own
        across = whole @ own
        left = whole - across @ linalg.solve(inner, across.T, assume_a="pos")
        size = np.sqrt(np.diag(left)[:width])
        covariance = np.linalg.inv(left[:width, :width] / np.outer(size, size)) / np.outer(size, size)
        return covariance @ left[:width, -1], covariance

    def _whole(self, members: Mapping[int, Member]) -> Array:
        """Factors of members among all white columns: of the plant, of hypotheses, the target."""
        own = self._stacked(members)
        before, behind = np.zeros((self.design.width, own.shape[1])), np.zeros((1, own.shape[1]))
        return np.vstack([before, own, behind])

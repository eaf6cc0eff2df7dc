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

from ident.diagnosis.core.design import Design
from ident.diagnosis.core.noise import Whitener

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

OCTAVES: Final = 1.0
"""Between neighbouring scales, in doublings: the evidence of one is that of the other but for a tenth."""


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
        weights: (G,) log of the prior mass of each number.
        total: of it, all of them integrated.
    """

    blocks: tuple[int, ...]
    scales: Array
    logs: Array
    weights: Array

    @property
    def total(self) -> float:
        """Log evidence, numbers and scale integrated."""
        return float(logsumexp(self.logs + self.weights[:, None]) - math.log(len(self.scales)))

    @property
    def best(self) -> tuple[Member, float]:
        """The numbers with the largest evidence, and that."""
        row, column = np.unravel_index(int(np.argmax(self.logs)), self.logs.shape)
        return Member(self.blocks[row], float(self.scales[column])), float(self.logs[row, column])


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

    def beside(self, members: Mapping[int, Member], columns: Indices | None = None) -> Array:
        """Products of columns and, last, the target, members integrated.

        Args:
            members: by hypothesis.
            columns: among all; None: all of them.
        """
        found = self._products
        chosen = np.arange(len(found)) if columns is None else np.append(columns, len(found) - 1)
        part: Array = found[np.ix_(chosen, chosen)]
        if not members:
            return part
        own = self._stacked(members)
        rows = np.flatnonzero(own.any(axis=1))
        own = own[rows]
        inner = np.eye(own.shape[1]) + own.T @ found[np.ix_(rows, rows)] @ own
        across = found[np.ix_(chosen, rows)] @ own
        return np.asarray(part - across @ linalg.solve(inner, across.T, assume_a="pos"))

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
        if not members:
            return 0.0
        own = self._stacked(members)
        rows = np.flatnonzero(own.any(axis=1))
        own = own[rows]
        inner = np.eye(own.shape[1]) + own.T @ self._products[np.ix_(rows, rows)] @ own
        amplitude = own.T @ self._products[rows, -1]
        factor = linalg.cho_factor(inner)
        gained = 0.5 * float(amplitude @ linalg.cho_solve(factor, amplitude))
        return gained - float(np.sum(np.log(np.diag(factor[0]))))

    def means(self, members: Mapping[int, Member]) -> dict[int, Array]:
        """Coefficients (K,) of the columns of every member."""
        if not members:
            return {}
        own = self._stacked(members)
        rows = np.flatnonzero(own.any(axis=1))
        inner = np.eye(own.shape[1]) + own[rows].T @ self._products[np.ix_(rows, rows)] @ own[rows]
        mean = own @ linalg.solve(inner, own[rows].T @ self._products[rows, -1], assume_a="pos")
        places = {index: self.design.blocks[one.block].place for index, one in members.items()}
        return {index: mean[place] / self.design.sizes[place] for index, place in places.items()}

    def table(self, hypothesis: int, members: Mapping[int, Member]) -> Table:
        """Log evidence of a hypothesis over its numbers and scales, beside members."""
        design = self.design
        own = design.of(hypothesis)
        columns = np.unique(np.concatenate([np.arange(len(design.sizes))[design.blocks[i].place] for i in own]))
        products = self.beside(members, columns)
        logs = np.empty((len(own), len(self.scales)))
        for row, index in enumerate(own):
            block = design.blocks[index]
            at = np.searchsorted(columns, np.arange(block.place.start, block.place.stop))
            if len(at) == 1:
                logs[row] = self._log(products[at[0], at[0]], products[at[0], -1])
            else:
                inner = block.factor.T @ products[np.ix_(at, at)] @ block.factor
                logs[row] = self._logs(inner, block.factor.T @ products[at, -1])
        return Table(own, self.scales, logs, np.array([design.blocks[index].weight for index in own]))

    def _log(self, power: float, amplitude: float) -> Array:
        """(S,) log evidence by scale, of one column of unit prior."""
        squares = self.scales**2
        return np.asarray(0.5 * (squares * amplitude**2 / (1 + squares * power) - np.log1p(squares * max(power, 0.0))))

    def trial(self, columns: Sequence[Array], members: Mapping[int, Member]) -> float:
        """Largest log evidence over the scales of columns (n, k) of every record, beside members."""
        basis, _ = self._plant
        pieces = zip(self.whiteners, columns, strict=True)
        white = np.vstack([whitener.white(part) for whitener, part in pieces])
        rest = self.white[:, self.design.width :]
        beside = np.column_stack([rest[:, :-1] @ self._stacked(members), white, rest[:, -1]])
        beside = beside - basis @ (basis.T @ beside)
        products, width = beside.T @ beside, beside.shape[1] - white.shape[1] - 1
        inner = np.eye(width) + products[:width, :width]
        products = products - products[:, :width] @ linalg.solve(inner, products[:width], assume_a="pos")
        return float(np.max(self._logs(products[width:-1, width:-1], products[width:-1, -1])))

    def _logs(self, inner: Array, amplitude: Array) -> Array:
        """(S,) log evidence by scale, of columns of unit prior with products (R, R) and (R,) with the target."""
        powers, turn = np.linalg.eigh(inner)
        amplitudes, powers = turn.T @ amplitude, np.maximum(powers, 0.0)
        squares = self.scales[:, None] ** 2
        gains = squares / (1 + squares * powers)
        return np.asarray(0.5 * np.sum(gains * amplitudes**2 - np.log1p(squares * powers), axis=1))

    def plant_parameters(self, members: Mapping[int, Member]) -> tuple[Array, Array]:
        """Mean (p,) and covariance (p, p) of the plant's parameters, members integrated."""
        width = self.design.width
        known = np.column_stack([self.white[:, :width], self.white[:, -1]])
        own = self.white[:, width:-1] @ self._stacked(members)
        inner = np.eye(own.shape[1]) + own.T @ own
        across = known.T @ own
        left = known.T @ known - across @ linalg.solve(inner, across.T, assume_a="pos")
        size = np.sqrt(np.diag(left)[:width])
        covariance = np.linalg.inv(left[:width, :width] / np.outer(size, size)) / np.outer(size, size)
        return covariance @ left[:width, -1], covariance

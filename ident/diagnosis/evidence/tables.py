"""Log evidence of hypotheses beside others, at every scale.

Single columns, which most hypotheses have, are looked at all together; several columns are a small eigenproblem.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.hypotheses.gram import Beside
from ident.diagnosis.hypotheses.hypotheses import Block

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Member:
    """A hypothesis that is taken, at the numbers that make its evidence largest: its block, and its scale."""

    block: int
    scale: float


Members = Mapping[int, Member]
"""By number of the hypothesis."""


@dataclass(frozen=True)
class Table:
    """Evidence of one hypothesis, beside others.

    Attributes:
        scales: (S,) tried.
        logs: (G, S) log evidence against its absence, by its numbers and scale, the prior mass of each included.
        occam: (G, S) of those, what integrating the coefficients costs.
        masses: (G,) log of the prior masses.
        blocks: (G,) numbers of the blocks.
    """

    scales: Array
    logs: Array
    occam: Array
    masses: Array
    blocks: Sequence[int]

    @cached_property
    def total(self) -> float:
        """Log evidence, numbers and scale integrated."""
        return float(np.logaddexp.reduce(self.logs, axis=None))

    @property
    def is_there(self) -> bool:
        """Whether it can be there at all."""
        return math.isfinite(self.total)

    @cached_property
    def _peak(self) -> tuple[int, int]:
        row, column = np.unravel_index(int(np.argmax(self.logs)), self.logs.shape)
        return int(row), int(column)

    @property
    def best(self) -> Member:
        """The numbers with the largest evidence."""
        row, column = self._peak
        return Member(self.blocks[row], float(self.scales[column]))

    @property
    def inside(self) -> float:
        """What integrating adds to the log likelihood at the best numbers, and what those cost."""
        if not self.is_there:
            return -math.inf
        return self.total - float(self.logs[self._peak]) + float(self.masses[self._peak[0]])

    @property
    def cost(self) -> float:
        """What the log evidence is below the log likelihood ratio at the best numbers."""
        return float(self.occam[self._peak]) - self.inside


def tables_of(
    hypotheses: Sequence[Sequence[Block]], at: Callable[[slice], slice], products: Beside, scales: Array, count: int
) -> list[Table]:
    """Log evidence of some hypotheses.

    Args:
        hypotheses: blocks of each.
        at: where columns of the design stand among the products.
        products: of all columns, others integrated.
        scales: (S,) tried, rising.
        count: number of the rows.
    """
    every = [block for blocks in hypotheses for block in blocks]
    masses = masses_of(every, scales)
    logs, occam = logs_of(every, [at(block.place) for block in every], products, scales, count)
    logs += masses[:, None]
    ends = np.cumsum([len(blocks) for blocks in hypotheses])[:-1]
    parts = zip(*(np.split(values, ends) for values in (logs, occam, masses)), strict=True)
    return [Table(scales, own, costs, mass, range(len(mass))) for own, costs, mass in parts]


def masses_of(blocks: Sequence[Block], scales: Array) -> Array:
    """(G,) log of the prior mass of every block at one of the scales (S,)."""
    allowed = np.searchsorted(scales, [block.largest for block in blocks], side="right")
    one_sided = np.array([math.log(2) if block.least == 0 else 0.0 for block in blocks])
    return np.asarray(np.array([block.weight for block in blocks]) - np.log(np.maximum(allowed, 1)) + one_sided)


def logs_of(
    blocks: Sequence[Block], places: Sequence[slice], products: Beside, scales: Array, count: int
) -> tuple[Array, Array]:
    """(G, S) log evidence of blocks against their absence, and what of that integrating the coefficients costs.

    Args:
        blocks: of any hypotheses.
        places: of their columns among the products.
        products, scales, count: as of `tables_of`.
    """
    logs, occam = np.full((len(blocks), len(scales)), -math.inf), np.zeros((len(blocks), len(scales)))
    single, several = list[int](), defaultdict[int, list[int]](list)
    for number, block in enumerate(blocks):
        if len(block.sizes) == 1:
            single.append(number)
        else:
            several[places[number].start].append(number)
    if single:
        starts = np.array([places[number].start for number in single])
        logs[single], occam[single] = _of_single([blocks[number] for number in single], starts, products, scales, count)
    for numbers in several.values():
        place = places[numbers[0]]
        inner, along = products.of(place, place), products.along[place]
        for number in numbers:
            logs[number], occam[number] = _of_several(blocks[number], inner, along, scales)
    largest = np.maximum([block.largest for block in blocks], scales[0])
    logs[scales > largest[:, None]] = -math.inf
    return logs, occam


def _of_single(
    blocks: Sequence[Block], places: NDArray[np.int64], products: Beside, scales: Array, count: int
) -> tuple[Array, Array]:
    """Of blocks of one column each."""
    powers, amplitudes = np.maximum(products.diagonal[places], 0.0), products.along[places]
    there = powers > np.finfo(float).eps * count
    coefficients = np.divide(amplitudes, powers, out=np.zeros_like(powers), where=there)
    impossible = ~there | _are_refused(blocks, coefficients / [float(block.sizes[0]) for block in blocks])
    beyond = np.zeros(len(blocks))
    for number, block in enumerate(blocks):
        if block.expected is not None and not impossible[number]:
            slope, wanted, beyond[number] = block.expected_of(float(amplitudes[number]))
            powers[number] += slope**2
            amplitudes[number] += slope * wanted
    squares = scales**2
    told = 1 + squares * powers[:, None]
    occam = 0.5 * np.log(told)
    logs = 0.5 * squares / told * amplitudes[:, None] ** 2 - occam - beyond[:, None]
    return np.where(impossible[:, None], -math.inf, logs), np.where(impossible[:, None], 0.0, occam)


def _are_refused(blocks: Sequence[Block], sizes: Array) -> NDArray[np.bool_]:
    """Which single coefficients are what their hypothesis is not: of the other sign, or too small to mean it."""
    least = np.array([block.least for block in blocks])
    negative, positive = np.array([block.negligible for block in blocks]).T
    small = np.where(sizes < 0, sizes >= -negative, sizes <= positive) & (sizes != 0)
    return np.asarray((sizes <= least) | small)


def _of_several(block: Block, inner: Array, along: Array, scales: Array) -> tuple[Array, Array]:
    """Of a block of several columns, by their products with each other and with the target."""
    powers, turn = np.linalg.eigh(block.factor.T @ inner @ block.factor)
    powers, amplitudes = np.maximum(powers, 0.0), turn.T @ (block.factor.T @ along)
    if block.least == 0 and _is_negative(turn, powers, amplitudes):
        return np.full(len(scales), -math.inf), np.zeros(len(scales))
    squares = scales[:, None] ** 2
    told = 1 + squares * powers
    occam = 0.5 * np.sum(np.log(told), axis=1)
    return 0.5 * np.sum(squares / told * amplitudes**2, axis=1) - occam, occam


def _is_negative(turn: Array, powers: Array, amplitudes: Array) -> bool:
    """Whether the first of some coefficients, which is the effect's own, is below zero, by rows alone."""
    told = powers > np.finfo(float).eps * powers.max(initial=0.0)
    return float(turn[0, told] @ (amplitudes[told] / powers[told])) <= 0

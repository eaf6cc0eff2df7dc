"""Log evidence of hypotheses beside others, at every scale.

Single columns, which most hypotheses have, are looked at all together; several columns are a small eigenproblem.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
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
    if not hypotheses:
        return []
    every = [block for blocks in hypotheses for block in blocks]
    masses = _masses(every, scales)
    logs, occam = _logs(every, [at(block.place) for block in every], products, scales, count)
    logs += masses[:, None]
    ends = np.cumsum([len(blocks) for blocks in hypotheses])[:-1]
    parts = zip(*(np.split(values, ends) for values in (logs, occam, masses)), strict=True)
    return [Table(scales, own, costs, mass, range(len(mass))) for own, costs, mass in parts]


def _masses(blocks: Sequence[Block], scales: Array) -> Array:
    """(G,) log of the prior mass of every block at one of the scales (S,)."""
    allowed = np.searchsorted(scales, [block.largest for block in blocks], side="right")
    one_sided = np.array([math.log(2) if block.least == 0 else 0.0 for block in blocks])
    return np.asarray(np.array([block.weight for block in blocks]) - np.log(np.maximum(allowed, 1)) + one_sided)


def _logs(
    blocks: Sequence[Block], places: Sequence[slice], products: Beside, scales: Array, count: int
) -> tuple[Array, Array]:
    """(G, S) log evidence of blocks against their absence, and what of that integrating the coefficients costs.

    Args:
        blocks: of any hypotheses.
        places: of their columns among the products.
        products, scales, count: as of `tables_of`.
    """
    logs, occam = np.full((len(blocks), len(scales)), -math.inf), np.zeros((len(blocks), len(scales)))
    single = [number for number, block in enumerate(blocks) if len(block.sizes) == 1]
    if single:
        starts = np.array([places[number].start for number in single])
        logs[single], occam[single] = _of_single([blocks[number] for number in single], starts, products, scales, count)
    for alike in _by_directions(blocks, places, products):
        logs[list(alike)], occam[list(alike)] = _of_several(blocks, alike, scales)
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


def _by_directions(
    blocks: Sequence[Block], places: Sequence[slice], products: Beside
) -> Iterable[Mapping[int, tuple[Array, Array]]]:
    """Products (R, R) and (R,) of the directions Φ of blocks of several columns, those of one number R together.

    Φ' X Φ and Φ' z by number of the block; a law of a single direction is one of these.
    """
    found = defaultdict[int, dict[int, tuple[Array, Array]]](dict)
    inner = dict[int, Array]()
    for number, (block, place) in enumerate(zip(blocks, places, strict=True)):
        if len(block.sizes) != 1:
            if place.start not in inner:
                inner[place.start] = products.of(place, place)
            turned = block.factor.T @ inner[place.start] @ block.factor
            found[len(turned)][number] = turned, block.factor.T @ products.along[place]
    return found.values()


def _of_several(
    blocks: Sequence[Block], alike: Mapping[int, tuple[Array, Array]], scales: Array
) -> tuple[Array, Array]:
    """Of blocks of several columns, by their products with each other and with the target."""
    powers, turn = np.linalg.eigh(np.stack([inner for inner, _ in alike.values()]))
    powers = np.maximum(powers, 0.0)
    amplitudes = np.einsum("gij,gi->gj", turn, np.stack([along for _, along in alike.values()]))
    squares = scales[:, None] ** 2
    told = 1 + squares * powers[:, None, :]
    occam = 0.5 * np.sum(np.log(told), axis=2)
    logs = 0.5 * np.sum(squares / told * amplitudes[:, None, :] ** 2, axis=2) - occam
    for place, number in enumerate(alike):
        if blocks[number].least == 0 and _is_negative(turn[place], powers[place], amplitudes[place]):
            logs[place], occam[place] = -math.inf, 0.0
    return logs, occam


def _is_negative(turn: Array, powers: Array, amplitudes: Array) -> bool:
    """Whether the first of some coefficients, which is the effect's own, is below zero, by rows alone."""
    told = powers > np.finfo(float).eps * powers.max(initial=0.0)
    return float(turn[0, told] @ (amplitudes[told] / powers[told])) <= 0

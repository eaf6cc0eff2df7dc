"""Periods of a force over an angle, from the spectrum of what the parameters leave.

Were the order of a ripple tried on a grid, one that the grid lacks would have no name. What the parameters leave of the
fitted rows is transformed over the angle instead (as Lomb 1976 does over time), lever and noise of every row allowed
for; its peaks are the orders worth trying, and a refit makes them exact. Chance has as many peaks as the record has
independent orders: their number is the price.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.law.dependence import Basis, Dependence
from ident.diagnosis.linear import least_squares, rms, unit_of
from ident.diagnosis.problem import Candidate, Problem, Variant
from ident.diagnosis.rows import kept_rows

Array = NDArray[np.float64]

PEAKS: Final = 3
"""Of a spectrum that are tried."""

PADDED: Final = 4
"""Points of a spectrum over its resolution."""

SHARE: Final = 0.1
"""Of the rows that must be slow enough for a wave over the angle to be within their bandwidth."""

MOST: Final = 2.0**17
"""Orders that are looked at, over the resolution: beyond them nothing but rows at rest is slow enough."""

FEWEST: Final = 2.0
"""Periods over the range of the angle below which a force is no ripple."""


def with_orders(problems: Sequence[Problem]) -> tuple[Problem, ...]:
    """The problems with the variants of every periodic candidate at the orders that the first one shows."""
    first = problems[0]
    numbers = [number for number, one in enumerate(first.candidates) if one.periodic is not None]
    if not numbers:
        return tuple(problems)
    residual = _left(first)
    found = {number: _peaks(first, first.candidates[number], residual) for number in numbers}
    return tuple(
        replace(
            problem,
            candidates=tuple(
                _at(problem, candidate, *found[number]) if number in found else candidate
                for number, candidate in enumerate(problem.candidates)
            ),
        )
        for problem in problems
    )


def _at(problem: Problem, candidate: Candidate, orders: Sequence[float], tried: float) -> Candidate:
    """A periodic candidate with a variant for every order [1/unit of the angle]."""
    if candidate.periodic is None or not orders:
        return candidate
    dependence = _dependence(problem, candidate)
    variants = tuple(
        Variant(tuple(dependence.design(_wave(order))), candidate.periodic.start(order)) for order in orders
    )
    return replace(candidate, variants=variants, price=math.log(max(tried, 1.0)))


def _wave(order: float) -> Basis:
    return lambda x: np.stack([np.sin(order * x), np.cos(order * x)], axis=-1)


def _dependence(problem: Problem, candidate: Candidate) -> Dependence:
    assert candidate.periodic is not None
    return next(one for one in problem.dependences if one.key == candidate.periodic.dependence)


def _left(problem: Problem) -> list[tuple[Array, float]]:
    """What the parameters leave of the target of every block (N,), and its rms in the rows used."""
    kept = [kept_rows(block) for block in problem.blocks]
    rows = [(one.mean(block.baseline), one.mean(block.target)) for block, one in zip(problem.blocks, kept, strict=True)]
    scaled = [np.column_stack(pair) / unit_of(*pair) for pair in rows]
    together = np.concatenate(scaled)
    parameters = least_squares(together[:, :-1], together[:, -1])
    left = [block.target - block.baseline @ parameters for block in problem.blocks]
    return [(series, rms(series[one.samples])) for series, one in zip(left, kept, strict=True)]


def _peaks(
    problem: Problem, candidate: Candidate, residual: Sequence[tuple[Array, float]]
) -> tuple[list[float], float]:
    """Orders of the largest peaks of the spectrum over the angle, and how many independent ones there are."""
    rows = list(_rows(problem, _dependence(problem, candidate), residual))
    if not rows:
        return [], 0.0
    angle, lever, left, reach = (np.concatenate(parts) for parts in zip(*rows, strict=True))
    span = float(np.ptp(angle))
    highest = min(float(np.quantile(reach, 1 - SHARE)), MOST * math.pi / max(span, np.finfo(float).tiny))
    if not span > 0 or not np.isfinite(highest) or highest * span < 2 * math.pi * FEWEST:
        return [], 0.0
    resolution = 2 * math.pi / span
    # Bins of a quarter of the shortest period: what falls between them is averaged by less than a tenth.
    width = math.pi / (2 * highest)
    bins = np.round((angle - angle.min()) / width).astype(np.int64)
    length = int(2 ** math.ceil(math.log2(PADDED * (bins.max() + 1))))
    summed = np.bincount(bins, left * lever, minlength=length)
    orders = 2 * math.pi * np.asarray(np.fft.rfftfreq(length, width), dtype=np.float64)
    slow = np.sort(reach)
    power = np.concatenate([np.cumsum((lever[np.argsort(reach)] ** 2)[::-1])[::-1], [0.0]])
    shown = power[np.searchsorted(slow, orders)]
    usable = (orders >= FEWEST * resolution) & (orders <= highest) & (shown > 0)
    ratio = np.where(usable, 2 * np.abs(np.fft.rfft(summed)) ** 2, 0.0) / np.where(usable, shown, 1.0)
    return _largest(orders, ratio, resolution), float(highest / resolution)


def _rows(
    problem: Problem, dependence: Dependence, residual: Sequence[tuple[Array, float]]
) -> Iterator[tuple[Array, Array, Array, Array]]:
    """Angle, lever over noise, what is left over noise, and the highest order within the bandwidth, by block."""
    levers = dependence.design(lambda x: np.ones((*np.shape(x), 1)))
    for block, x, lever, (left, noise) in zip(problem.blocks, dependence.arguments, levers, residual, strict=True):
        chosen = kept_rows(block).samples.ravel()
        if x is None or lever is None or not noise > 0 or not chosen.size:
            continue
        rate = np.abs(np.gradient(x[:, 0], block.sample_time))[chosen]
        reach = block.bandwidth / np.maximum(rate, np.finfo(float).tiny)
        yield x[chosen, 0], lever[chosen, 0] / noise, left[chosen] / noise, reach


def _largest(orders: Array, ratio: Array, resolution: float) -> list[float]:
    """Orders (up to PEAKS) of the largest peaks, each a resolution from the others."""
    found: list[float] = []
    left = ratio.copy()
    for _ in range(PEAKS):
        best = int(np.argmax(left))
        if left[best] <= 0:
            break
        found.append(float(orders[best]))
        left[np.abs(orders - orders[best]) < resolution] = 0.0
    return found

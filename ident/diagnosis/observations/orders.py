"""Periods of a force over an angle, from the spectrum of what the parameters leave.

Were the order of a ripple tried on a grid, one that the grid lacks would have no name. What the parameters leave of the
fitted rows is transformed over the angle instead (`periodogram`), lever and noise of every row allowed for; its peaks
are the orders worth trying, and a refit makes them exact. Chance has as many peaks as the record has
independent orders: their number is the price.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.dependence import Basis, Dependence
from ident.diagnosis.observations.linear import least_squares, rms, unit_of
from ident.diagnosis.observations.periodogram import Periodogram, Turned, periodogram
from ident.diagnosis.observations.rows import kept_rows
from ident.diagnosis.problem import Candidate, Problem, Variant

Array = NDArray[np.float64]

PEAKS: Final = 3
"""Of a spectrum that are tried."""


def with_orders(
    problems: Sequence[Problem], numbers: Iterable[int] | None = None, taken: Sequence[Variant] = ()
) -> tuple[Problem, ...]:
    """The problems with the variants of periodic candidates at the orders that the first one shows.

    Args:
        problems: to fit, and to confirm.
        numbers: of the candidates that are asked for; None: all.
        taken: causes that are known, as their columns in the problem to fit.
    """
    found = shown_orders(problems[0], range(len(problems[0].candidates)) if numbers is None else numbers, taken)
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


def shown_orders(
    problem: Problem, numbers: Iterable[int], taken: Sequence[Variant]
) -> Mapping[int, tuple[list[float], float]]:
    """Orders that the rows show, and how many were independent, of every periodic candidate.

    Args:
        problem: to fit.
        numbers: of the candidates that are asked for.
        taken: causes that are known, as their columns, which are fitted along with the parameters.
    """
    periodic = [number for number in numbers if problem.candidates[number].periodic is not None]
    if not periodic:
        return {}
    residual = _left(problem, taken)
    return {number: _peaks(problem, problem.candidates[number], residual) for number in periodic}


def waves(problem: Problem, candidate: Candidate, orders: Sequence[float]) -> tuple[Variant, ...]:
    """Of a periodic candidate, a variant for every order [1/unit of the angle]."""
    assert candidate.periodic is not None
    dependence = _dependence(problem, candidate)
    return tuple(Variant(tuple(dependence.design(_wave(order))), candidate.periodic.start(order)) for order in orders)


def _at(problem: Problem, candidate: Candidate, orders: Sequence[float], tried: float) -> Candidate:
    """A periodic candidate with its orders alone, if there are any."""
    if not orders:
        return candidate
    return replace(candidate, variants=waves(problem, candidate, orders), price=price_of(tried))


def price_of(tried: float) -> float:
    """Log evidence that the choice among independent orders costs."""
    return math.log(max(tried, 1.0))


def _wave(order: float) -> Basis:
    return lambda x: np.stack([np.sin(order * x), np.cos(order * x)], axis=-1)


def _dependence(problem: Problem, candidate: Candidate) -> Dependence:
    assert candidate.periodic is not None
    return next(one for one in problem.dependences if one.key == candidate.periodic.dependence)


def _left(problem: Problem, taken: Sequence[Variant]) -> list[tuple[Array, float]]:
    """What the parameters, and causes taken, leave of the target of every block (N,), and its rms in the rows used."""
    kept = [kept_rows(block) for block in problem.blocks]
    designs = [
        np.hstack([block.baseline, *_columns(taken, place, len(block.target))])
        for place, block in enumerate(problem.blocks)
    ]
    means = [one.mean(design) for design, one in zip(designs, kept, strict=True)]
    targets = [one.mean(block.target) for block, one in zip(problem.blocks, kept, strict=True)]
    units = [
        unit_of(one.mean(block.baseline), target)
        for block, one, target in zip(problem.blocks, kept, targets, strict=True)
    ]
    scaled = [np.column_stack(parts) / unit for *parts, unit in zip(means, targets, units, strict=True)]
    together = np.concatenate(scaled)
    parameters = least_squares(together[:, :-1], together[:, -1])
    left = [block.target - design @ parameters for block, design in zip(problem.blocks, designs, strict=True)]
    return [(series, rms(series[one.samples])) for series, one in zip(left, kept, strict=True)]


def _columns(taken: Sequence[Variant], place: int, length: int) -> list[Array]:
    """Columns (length, k) of some variants in one block; zeros where they do not act."""
    widths = [max((one.shape[1] for one in variant.columns if one is not None), default=0) for variant in taken]
    there = [variant.columns[place] for variant in taken]
    return [np.zeros((length, width)) if one is None else one for one, width in zip(there, widths, strict=True)]


def _peaks(
    problem: Problem, candidate: Candidate, residual: Sequence[tuple[Array, float]]
) -> tuple[list[float], float]:
    """Orders of the largest peaks of the spectrum over the angle, and how many independent ones there are."""
    parts = list(_rows(problem, _dependence(problem, candidate), residual))
    if not parts:
        return [], 0.0
    found = periodogram(Turned(*(np.concatenate(series) for series in zip(*parts, strict=True))))
    return ([], 0.0) if found is None else (_largest(found), found.independent)


def _rows(
    problem: Problem, dependence: Dependence, residual: Sequence[tuple[Array, float]]
) -> Iterator[tuple[Array, Array, Array, Array]]:
    """What `Turned` is made of, by block."""
    levers = dependence.design(lambda x: np.ones((*np.shape(x), 1)), apart=True)
    for block, x, lever, (left, noise) in zip(problem.blocks, dependence.arguments, levers, residual, strict=True):
        chosen = kept_rows(block).samples.ravel()
        if x is None or lever is None or not noise > 0 or not chosen.size:
            continue
        rate = np.abs(np.gradient(x, block.sample_time, axis=0))[chosen]
        reach = block.bandwidth / np.maximum(rate, np.finfo(float).eps)
        yield x[chosen], lever[chosen] / noise, left[chosen] / noise, reach


def _largest(spectrum: Periodogram) -> list[float]:
    """Orders (up to PEAKS) of the largest peaks, each a resolution from the others."""
    found: list[float] = []
    left = spectrum.explained.copy()
    for _ in range(PEAKS):
        best = int(np.argmax(left))
        if left[best] <= 0:
            break
        found.append(float(spectrum.orders[best]))
        left[np.abs(spectrum.orders - spectrum.orders[best]) < spectrum.resolution] = 0.0
    return found

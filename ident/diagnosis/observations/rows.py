"""From blocks to the rows that statistics work on: repeats averaged, thinned to the bandwidth, stiction left out.

The average over repeats of a linear model is a linear model of the averages, so nothing is lost but noise, and what is
left of the residual is what repeats. Thinning takes every n-th row: the filter has already taken away what lies above.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.observations.linear import rms
from ident.diagnosis.problem import Block, Candidate, Problem
from ident.records.repeats import repeats_of

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

ROWS_PER_CUTOFF: Final = 3.0
"""Rows a second over the filter's cutoff frequency: Nyquist lies half as high again as the cutoff."""


@dataclass(frozen=True)
class Kept:
    """Which samples of a block become rows.

    Attributes:
        samples: (P, m) sample of every row in each of P repeats; P = 1 where nothing repeats.
        runs: (m,) number of the uninterrupted stretch that a row belongs to.
        rate: rows a second [1/s].
    """

    samples: Indices
    runs: Indices
    rate: float

    def mean(self, series: Array) -> Array:
        """Rows (m, ...) of a series (N, ...): the mean over the repeats."""
        return np.asarray(series[self.samples].mean(axis=0))


@dataclass(frozen=True)
class Column:
    """Where the columns of one variant of a candidate stand in `Rows.columns`.

    Attributes:
        candidate, variant: numbers.
        place: among all columns.
        least: value that all of its coefficients must reach, -inf where there is none such.
        negligible: sizes that its one coefficient must exceed, where it is negative and where it is positive.
        beside: columns, the last ones, that only come along.
        itself: whether the other ones are the effect by itself.
    """

    candidate: int
    variant: int
    place: slice
    least: float
    negligible: tuple[float, float]
    beside: int = 0
    itself: bool = True

    @property
    def own(self) -> slice:
        """Where those stand that do not only come along."""
        return slice(self.place.start, max(self.place.start, self.place.stop - self.beside))

    @property
    def width(self) -> int:
        """Number of columns."""
        return int(self.place.stop - self.place.start)


@dataclass(frozen=True)
class Rows:
    """Compact regression of one or two problems behind each other; n rows.

    Attributes:
        target: (n,).
        baseline: (n, p).
        columns: (n, K) of all variants of all candidates.
        layout: which are whose.
        group: (n,) rows of one channel, step and coordinate of one problem share the colour of their noise.
        run: (n,) uninterrupted stretches, numbered through.
        confirming: (n,) rows that take no part in the fit.
        blocks: of the problems, in order, with the samples kept of each.
    """

    target: Array
    baseline: Array
    columns: Array
    layout: tuple[Column, ...]
    group: Indices
    run: Indices
    confirming: NDArray[np.bool_]
    blocks: tuple[tuple[Block, Kept], ...]

    def __len__(self) -> int:
        return len(self.target)

    @property
    def block_slices(self) -> list[slice]:
        """Rows of every block."""
        ends = np.cumsum([kept.samples.shape[1] for _, kept in self.blocks])
        return [
            slice(int(end - kept.samples.shape[1]), int(end)) for end, (_, kept) in zip(ends, self.blocks, strict=True)
        ]

    def levels(self, residual: Array) -> Array:
        """Rms (n,) of what is left (n,) of the group of every row; one where nothing is."""
        found = np.ones(len(self))
        for group in np.unique(self.group):
            place = self.group == group
            found[place] = rms(residual[place]) or 1.0
        return found

    def stack(self, series: Sequence[Array | None], width: int | None = None) -> Array:
        """Rows of one series a block, (N,) or (N, k); None stands for zeros."""
        return _stack([kept for _, kept in self.blocks], series, width)


def kept_rows(block: Block) -> Kept:
    """Moving rows, thinned; repeats beside each other where there are at least two."""
    stride = max(1, math.floor(2 * math.pi / (ROWS_PER_CUTOFF * block.bandwidth * block.sample_time)))
    samples = repeats_of(block.period)[:, ::stride]
    usable = block.moving[samples].all(axis=0)
    runs = np.cumsum(np.diff(usable.astype(np.int64), prepend=0) == 1)
    return Kept(samples[:, usable], runs[usable], 1 / (stride * block.sample_time))


def make_rows(fit: Problem, confirm: Problem | None = None) -> Rows:
    """Rows of a problem to fit, and behind them those of one to confirm.

    Raises:
        ValueError: the two do not have the same parameters and candidates.
    """
    problems = [fit] if confirm is None else [fit, confirm]
    keys = [[candidate.key for candidate in problem.candidates] for problem in problems]
    if any(problem.names != fit.names for problem in problems) or any(key != keys[0] for key in keys):
        raise ValueError("The problems to fit and to confirm differ in parameters or candidates.")
    blocks = [(number, block, kept_rows(block)) for number, problem in enumerate(problems) for block in problem.blocks]
    kept = [rows for _, _, rows in blocks]
    columns, layout = _candidate_columns(problems, kept)
    counts = [rows.samples.shape[1] for rows in kept]
    return Rows(
        target=_stack(kept, [block.target for _, block, _ in blocks], None),
        baseline=_stack(kept, [block.baseline for _, block, _ in blocks], len(fit.names)),
        columns=columns,
        layout=layout,
        group=_groups([(n, b.channel, b.step, b.coordinate) for n, b, _ in blocks], counts),
        run=_through([rows.runs for rows in kept]),
        confirming=np.repeat(np.array([number == 1 for number, _, _ in blocks], dtype=bool), counts),
        blocks=tuple((block, rows) for _, block, rows in blocks),
    )


def _stack(kept: Sequence[Kept], series: Sequence[Array | None], width: int | None) -> Array:
    shape = () if width is None else (width,)
    parts = [
        np.zeros((rows.samples.shape[1], *shape)) if one is None else rows.mean(one)
        for rows, one in zip(kept, series, strict=True)
    ]
    return np.concatenate(parts)


def _candidate_columns(problems: Sequence[Problem], kept: Sequence[Kept]) -> tuple[Array, tuple[Column, ...]]:
    stacks, layout, end = [np.zeros((sum(rows.samples.shape[1] for rows in kept), 0))], [], 0
    for index, candidates in enumerate(zip(*(problem.candidates for problem in problems), strict=True)):
        for number in range(len(candidates[0].variants)):
            series = [column for candidate in candidates for column in candidate.variants[number].columns]
            if any(candidate.excluded for candidate in candidates):
                series = [None] * len(series)
            width = next((column.shape[1] for column in series if column is not None), 0)
            stacks.append(_stack(kept, series, width))
            variant, place = candidates[0].variants[number], slice(end, end + width)
            bounds = _bounds(candidates[0], width)
            along = {"beside": variant.beside, "itself": variant.itself}
            layout.append(Column(index, number, place, *bounds, **along))
            end += width
    return np.hstack(stacks), tuple(layout)


def _bounds(candidate: Candidate, width: int) -> tuple[float, tuple[float, float]]:
    least = -math.inf if candidate.least is None else candidate.least
    return least, candidate.negligible if width == 1 else (0.0, 0.0)


def _groups(labels: Sequence[tuple[int, str, str, str]], counts: Sequence[int]) -> Indices:
    """Group (n,) of every row, numbered through those that have rows."""
    numbers: dict[tuple[int, str, str, str], int] = {}
    for label, count in zip(labels, counts, strict=True):
        if count:
            numbers.setdefault(label, len(numbers))
    return np.repeat([numbers.get(label, 0) for label in labels], counts).astype(np.int64)


def _through(runs: Sequence[Indices]) -> Indices:
    numbered, end = [np.zeros(0, dtype=np.int64)], 0
    for part in runs:
        numbered.append(part + end)
        end += int(part.max(initial=0)) + 1
    return np.concatenate(numbered)

"""Rows to fit and rows to confirm from one set of records, where no independent ones are given."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ident.diagnosis.problem import Block, Problem

Mask = NDArray[np.bool_]
Numbers = NDArray[np.int64]

FITTED: Final = 0.6
"""Part of a record without repeats that is fitted; the rest confirms."""

TURNS: Final = 3
"""Of fitting and confirming parts in such a record: motions often change along it, and what the fitted part does not
show, the other one cannot confirm."""


def split_problem(problem: Problem) -> tuple[Problem, Problem]:
    """A problem to fit and one to confirm: the first half of the repeats of every block and the others, or, without
    repeats, parts of it by turns.
    """
    fitted = tuple(_part(block, confirming=False) for block in problem.blocks)
    confirmed = tuple(_part(block, confirming=True) for block in problem.blocks)
    return replace(problem, blocks=fitted), replace(problem, blocks=confirmed)


def part_of(moving: Mask, period: Numbers, guard: int, *, confirming: bool) -> tuple[Mask, Numbers]:
    """Those of the moving rows (N,) that are fitted, or confirm, and the numbers of the repeats (N,) in that part.

    Args:
        moving: rows that are used.
        period: number of the repeat, -1 outside of any.
        guard: rows that neither part has where one follows the other.
        confirming: which part.
    """
    repeats = np.unique(period[period >= 0])
    if len(repeats) >= 2:
        fitted = repeats[: (len(repeats) + 1) // 2]
        inside = (period >= 0) & (np.isin(period, fitted) != confirming)
        return moving & inside, np.where(inside, period, -1)
    rank = np.maximum(np.cumsum(moving) - 1, 0) / max(int(moving.sum()), 1)
    confirms = (TURNS * rank) % 1.0 > FITTED
    border = ndimage.binary_dilation(np.diff(confirms, prepend=confirms[:1]), np.ones(2 * guard + 1))
    return moving & (confirms == confirming) & ~(border & confirms), period


def guard_of(bandwidth: float, sample_time: float) -> int:
    """Rows over which a filter of some bandwidth [rad/s] spreads what one of them has."""
    return round(4 / (bandwidth * sample_time))


def _part(block: Block, *, confirming: bool) -> Block:
    guard = guard_of(block.bandwidth, block.sample_time)
    moving, period = part_of(block.moving, block.period, guard, confirming=confirming)
    return replace(block, moving=moving, period=period)

"""Rows to fit and rows to confirm from one set of records, where no independent ones are given."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.problem import Block, Problem

Mask = NDArray[np.bool_]
Numbers = NDArray[np.int64]

FITTED: Final = 0.6
"""Part of a record without repeats that is fitted; what follows confirms."""


def split_problem(problem: Problem) -> tuple[Problem, Problem]:
    """A problem to fit and one to confirm: the first half of the repeats of every block and the others, or, without
    repeats, an earlier and a later part.
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
    rows = np.flatnonzero(moving)
    border = rows[int(FITTED * (len(rows) - 1))] if rows.size else 0
    number = np.arange(len(moving))
    return moving & (number > border + guard if confirming else number <= border), period


def guard_of(bandwidth: float, sample_time: float) -> int:
    """Rows over which a filter of some bandwidth [rad/s] spreads what one of them has."""
    return round(4 / (bandwidth * sample_time))


def _part(block: Block, *, confirming: bool) -> Block:
    guard = guard_of(block.bandwidth, block.sample_time)
    moving, period = part_of(block.moving, block.period, guard, confirming=confirming)
    return replace(block, moving=moving, period=period)

"""Rows to fit and rows to confirm from one set of records, where no independent ones are given."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.gap.problem import Block, Problem

FITTED: Final = 0.6
"""Part of a record without repeats that is fitted; what follows confirms."""


def split_problem(problem: Problem) -> tuple[Problem, Problem]:
    """A problem to fit and one to confirm: the first half of the repeats of every block and the others, or, without
    repeats, an earlier and a later part.
    """
    fitted = tuple(_part(block, confirming=False) for block in problem.blocks)
    confirmed = tuple(_part(block, confirming=True) for block in problem.blocks)
    return replace(problem, blocks=fitted), replace(problem, blocks=confirmed)


def fitted_repeats(repeats: NDArray[np.int64]) -> NDArray[np.int64]:
    """Of the numbers of repeats (P,), in order, those that are fitted; the others confirm."""
    return repeats[: (len(repeats) + 1) // 2]


def _part(block: Block, *, confirming: bool) -> Block:
    repeats = np.unique(block.period[block.period >= 0])
    if len(repeats) >= 2:
        inside = (block.period >= 0) & (np.isin(block.period, fitted_repeats(repeats)) != confirming)
        return replace(block, moving=block.moving & inside, period=np.where(inside, block.period, -1))
    rows = np.flatnonzero(block.moving)
    border = rows[int(FITTED * (len(rows) - 1))] if rows.size else 0
    guard = round(4 / (block.bandwidth * block.sample_time))
    number = np.arange(len(block.target))
    inside = number > border + guard if confirming else number <= border
    return replace(block, moving=block.moving & inside)

"""Where records tell a law: not beyond the values of its variable that it was learnt on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.dependence import Dependence
from ident.diagnosis.observations.rows import Rows
from ident.diagnosis.problem import Problem

Mask = NDArray[np.bool_]


def told_samples(rows: Rows, problems: Sequence[Problem], keys: Sequence[str]) -> tuple[Mask, ...]:
    """Samples (N,) of every block in which all laws are within what the fitted rows have shown; empty without laws.

    Args:
        rows: of the problems.
        problems: to fit and to confirm, with the dependences.
        keys: of the laws; those that come around are told everywhere.
    """
    found: list[Mask] = [np.ones(len(block.target), dtype=bool) for block, _ in rows.blocks]
    for key in keys:
        parts = [one for problem in problems for one in problem.dependences if one.key == key]
        if not parts or parts[0].period:
            continue
        low, high = _shown(rows, parts)
        series = (x for part in parts for x in part.arguments)
        for told, x in zip(found, series, strict=True):
            if x is not None:
                told &= ((x >= low) & (x <= high)).all(axis=1)
    return tuple(found) if keys else ()


def _shown(rows: Rows, parts: Sequence[Dependence]) -> tuple[float, float]:
    """Least and largest value of a variable in the fitted rows."""
    series = [x for part in parts for x in part.arguments]
    shown = [
        x[kept.samples]
        for x, (_, kept), place in zip(series, rows.blocks, rows.block_slices, strict=True)
        if x is not None and kept.samples.size and not rows.confirming[place].any()
    ]
    if not shown:
        return -np.inf, np.inf
    return min(float(x.min()) for x in shown), max(float(x.max()) for x in shown)

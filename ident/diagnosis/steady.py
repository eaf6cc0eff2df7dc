"""Whether causes have one size everywhere: the same coefficients in every step, or others in each.

A cause that stands in for another one fits every step, but each with numbers of its own. What a residual as a whole
does not show, a few coefficients may: the evidence for letting them differ from step to step (Chow 1960), with the
price that every number has.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.directions import directions
from ident.diagnosis.evidence import scatter
from ident.diagnosis.regression import Regression
from ident.diagnosis.rows import Column
from ident.diagnosis.search import Found

Array = NDArray[np.float64]


def log_unsteady(regression: Regression, found: Found) -> float:
    """Log evidence that the causes found have other coefficients in some steps than in the others."""
    white = regression.white(found.whitener, found.variants)
    columns = _by_step(regression, white.baseline[:, regression.rows.baseline.shape[1] :])
    everywhere = Column(0, 0, slice(0, columns.shape[1]), -math.inf, (0.0, 0.0))
    added = directions(replace(white, columns=columns), [everywhere])
    count = added.basis.shape[1]
    if count == 0:
        return 0.0
    ratio = float(np.sum((added.basis.T @ added.residual) ** 2))
    scaled = ratio / scatter(added.basis, added.residual, white.stretch)
    return float(0.5 * (scaled - count * math.log(len(white.target))))


def _by_step(regression: Regression, taken: Array) -> Array:
    """Columns (n, k) of the causes, each once for every step and channel that it acts in."""
    rows = regression.rows
    labels = [(block.step, block.channel) for block, _ in rows.blocks]
    parts = [np.zeros((len(taken), 0))]
    for label in dict.fromkeys(labels):
        kept = np.zeros(len(taken), dtype=bool)
        for place in [place for place, one in zip(rows.block_slices, labels, strict=True) if one == label]:
            kept[place] = True
        part = taken * kept[:, None]
        parts.append(part[:, np.any(part != 0, axis=0)])
    return np.hstack(parts)

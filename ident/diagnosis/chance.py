"""Whether what seems to repeat is noise: few rows and few repeats have means that differ from zero by accident."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from ident.diagnosis.rows import Kept, Rows

Array = NDArray[np.float64]

LAGS: Final = 10
"""Rows over which noise is taken to remember itself: some three periods of the filter's cutoff."""


def chances(rows: Rows, floors: Array, models: Sequence[Array]) -> Mapping[str, float]:
    """Probability that noise alone has means over the repeats as large as what the models leave, by coordinate.

    The power of the mean over that of its noise is F-distributed; blocks of one coordinate are independent (Fisher's
    method).

    Args:
        rows: of the blocks.
        floors: rms of the noise of every block, and of what is tolerated in it.
        models: of every block's target, (N,).
    """
    logs: dict[str, list[float]] = {}
    for (block, kept), floor, model in zip(rows.blocks, floors.tolist(), models, strict=True):
        repeats, count = kept.samples.shape
        if repeats >= 2 and count:
            residual = block.target - model
            free = _independent(kept, residual)
            ratio = repeats * float(np.mean((kept.mean(residual) / floor) ** 2))
            logs.setdefault(block.label, []).append(float(stats.f.logsf(ratio, free, free * (repeats - 1))))
    return {label: float(stats.chi2.sf(-2 * sum(those), 2 * len(those))) for label, those in logs.items()}


def _independent(kept: Kept, residual: Array) -> float:
    """How many independent rows have as sure a power as the rows of a repeat, whose noise remembers itself."""
    noise = residual[kept.samples] - kept.mean(residual)
    count = noise.shape[1]
    products = [float(np.sum(noise[:, lag:] * noise[:, : count - lag])) for lag in range(min(LAGS, count - 1) + 1)]
    memory = np.array(products[1:]) / max(products[0], np.finfo(float).tiny)
    return float(count / (1 + 2 * np.sum(memory**2)))

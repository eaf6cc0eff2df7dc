"""Repeats of an excitation: which samples are the same phase of each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.int64]


def repeats_of(period: Indices) -> Indices:
    """Samples (P, T) of every repeat, one phase a column, as long as the shortest; all in one row for fewer than two.

    Args:
        period: (N,) number of the repeat of every sample, negative outside of any.
    """
    numbers = [number for number in np.unique(period) if number >= 0]
    if len(numbers) < 2:
        return np.arange(len(period))[None]
    found = [np.flatnonzero(period == number) for number in numbers]
    length = min(map(len, found))
    return np.stack([samples[:length] for samples in found])

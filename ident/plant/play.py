"""The play operator (Krasnosel'skii and Pokrovskii 1989): what follows something else within a play of it.

It is what lies behind a gap, and the load of a spring whose other end dry friction holds.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def behind_play(driving: Array, half: float, start: float) -> Array:
    """What follows (N,): y after a sample is y clipped to x - half and x + half.

    Args:
        driving: x (N,), in whatever unit.
        half: of the play, in the same; not negative.
        start: y before the first sample.
    """
    # Two clips, one after the other, are one: a scan by doubling.
    low, high = driving - half, driving + half
    steps = 1
    while steps < len(driving) and np.any(low[steps:] < high[steps:]):
        lower, higher = (np.clip(end[:-steps], low[steps:], high[steps:]) for end in (low, high))
        low[steps:], high[steps:] = lower, higher
        steps *= 2
    return np.asarray(np.clip(start, low, high))

"""Colour of rows by Burg's autoregression.

They are filtered, and mostly slow: their spectrum falls by many orders. Autocovariances of a record (Yule and Walker)
see that through the window of its length, whose side lobes are then the noise that is taken for its fast part. Burg
(1967) minimizes the errors of predictions forward and backward within the record and knows no window (Kay, Modern
Spectral Estimation, 1988, chapter 7). What is whitened keeps a floor of `whitening.TAPER` of the variance all the same.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ORDER: Final = 20
"""Of the autoregression: slow noise hides below fast noise, and shows only over many rows."""


def autocovariance(residual: Array, age: NDArray[np.int64]) -> Array:
    """(ORDER + 1,) of the autoregression that predicts every row best from those before it, and those before from it.

    Args:
        residual: (n,) of runs behind each other.
        age: (n,) how many rows of the same run lie before each.
    """
    forward, backward = residual.copy(), residual.copy()
    found = np.zeros(ORDER + 1)
    found[0] = variance = float(residual @ residual) / max(len(residual), 1)
    weights = np.zeros(0)
    for order in range(1, ORDER + 1):
        later = np.flatnonzero(age >= order)
        ahead, behind = forward[later], backward[later - 1]
        power = 0.5 * float(ahead @ ahead + behind @ behind)
        # Hardly more rows than coefficients, at the ends of the longest runs, predict nothing.
        reflection = float(ahead @ behind) / power if power > 0 and len(later) >= 2 * order else 0.0
        found[order] = reflection * variance + weights @ found[order - 1 : 0 : -1]
        weights = np.append(weights - reflection * weights[::-1], reflection)
        variance *= 1 - reflection**2
        forward[later], backward[later] = ahead - reflection * behind, behind - reflection * ahead
    return found

"""Functions drawn at random: a Gaussian process of unit variance, and over which length it changes."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LENGTHS: Final = (0.1, 0.6)
"""Over which a function changes, as a share of the range of its variable; of a periodic one, of the period."""


def draw_length(generator: np.random.Generator) -> float:
    """One of LENGTHS, every factor as likely."""
    return math.exp(generator.uniform(math.log(LENGTHS[0]), math.log(LENGTHS[1])))


def smooth_values(distance: Array, length: float, generator: np.random.Generator) -> Array:
    """Values (n,) of a process with a squared-exponential kernel.

    Args:
        distance: (n, n) between the places of the values.
        length: over which they change.
        generator: draws them.
    """
    powers, vectors = np.linalg.eigh(np.exp(-0.5 * (distance / length) ** 2))
    return np.asarray(vectors @ (np.sqrt(np.maximum(powers, 0.0)) * generator.normal(size=len(distance))))

"""Numbers of a shape that are tried first: at equal ratios, from the least that rows can bound to the most."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

RATIO: Final = 1.5
"""Between neighbours, at most: a descent, or an interpolation, reaches the rest."""

SMALLEST: Final = 1e-3
"""Of the most: what a shape does within less is over before the next row."""


def tried_between(least: float, most: float) -> tuple[float, ...]:
    """Numbers at equal ratios, both ends included; `least` alone where `most` is not beyond it.

    Args:
        least, most: in whatever unit; rows that bound nothing would ask for ever more, so `least` counts from a
            thousandth of `most` on.
    """
    least = max(least, SMALLEST * most)
    if most <= least:
        return (least,)
    count = 1 + math.ceil(math.log(most / least) / math.log(RATIO))
    return tuple(np.geomspace(least, most, count).tolist())

"""What a series costs that is no prediction, but was taken from the rows that it then takes away.

A wheel that slides on the floor is found where it runs ahead, by as much as it does: a number at every moment that the
filter lets pass. As columns of one coefficient it would explain all of that for the price of a single number, and
whatever else makes wheels run ahead would pass for it.
"""

from __future__ import annotations

from collections import defaultdict

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.noise.colours import USUAL, Colours
from ident.diagnosis.observations.rows import Kept
from ident.diagnosis.problem import Block

Array = NDArray[np.float64]


def information_in(series: Array, colours: Colours) -> float:
    """Log evidence that a series costs as numbers of its own, at least, each as large as it is there [nat].

    Within the band of the filter the series is any process with that size (rms) at every moment: half the log of the
    determinant of its covariance and that of the noise, over that of the noise alone (the information of a Gaussian
    channel, Shannon 1948). At least, for half a nat a number more is what a process that is told by the rows leaves of
    them. Channels see the same numbers: that counts which tells most of them. Coordinates are counted one by one: of a
    single wheel, which stands in two of them, that is more than there is.

    Args:
        series: (n,) in all rows.
        colours: noise of the rows, in which nothing is lacking but what is tolerated.
    """
    told: dict[str, float] = defaultdict(float)
    for number, (place, (block, kept)) in enumerate(zip(colours.places, colours.kept, strict=True)):
        size = np.abs(series[place])
        if size.any():
            half, _ = colours.of_block(number, USUAL, size[:, None] * _correlation(block, kept) * size)
            white, _ = colours.of_block(number, USUAL, half.T)
            told[block.channel] += 0.5 * float(np.linalg.slogdet(np.eye(len(white)) + white)[1])
    return max(told.values(), default=0.0)


def _correlation(block: Block, kept: Kept) -> Array:
    """(m, m) of rows of a process that is white up to the cutoff of the filter."""
    time = kept.samples[0] * block.sample_time
    return np.asarray(np.sinc(block.bandwidth / np.pi * np.subtract.outer(time, time)))

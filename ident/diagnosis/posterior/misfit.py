"""How much less the rows say of a member than their noise would have it.

Where all hypotheses are a little wrong, evidence grows with the rows as if each of them was new. The sandwich over
stretches of rows (White 1982) is the variance of what is found whatever the noise is. Its ratio to the variance by the
noise, along a member, is what the evidence for this is divided by (Pauli, Racugno and Ventura 2011).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def excess_of_scatter(
    white: Array, target: Array, known: tuple[Array, Array], stretch: NDArray[np.int64], places: Sequence[slice]
) -> list[float]:
    """Ratios of the variances of what is found along every member, at least one.

    Args:
        white: (n, k) rows in units of the noise, of coefficients of unit variance.
        target: (n,).
        known: (m, k) and (m,) rows beside those of the records, in standard deviations.
        stretch: (n,) number of the stretch that each row belongs to, rising.
        places: columns of every member.
    """
    beside, wanted = known
    inverse = np.linalg.inv(np.eye(white.shape[1]) + white.T @ white + beside.T @ beside)
    found = inverse @ (white.T @ target + beside.T @ wanted)
    starts = np.flatnonzero(np.diff(stretch, prepend=-1) != 0)
    scores = np.add.reduceat(white * (target - white @ found)[:, None], starts, axis=0)
    # What is known otherwise, the priors included, is as uncertain as it says.
    otherwise = inverse @ (np.eye(len(inverse)) + beside.T @ beside) @ inverse
    scattered = scores @ inverse
    ratios = []
    for place in places:
        along = np.linalg.solve(inverse[place, place], found[place])
        by_noise = float(along @ inverse[place, place] @ along)
        by_rows = float(np.sum((scattered[:, place] @ along) ** 2) + along @ otherwise[place, place] @ along)
        ratios.append(max(by_rows / by_noise, 1.0) if by_noise > 0 else 1.0)
    return ratios

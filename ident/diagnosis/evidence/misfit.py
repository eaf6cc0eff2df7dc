"""Ratio of the sandwich variance to the variance by the noise, along each member of a set.

Where all hypotheses are a little wrong, the likelihood grows with the rows as if each of them was new. The sandwich
over stretches of rows (White 1982) is the variance of what is found whatever the noise is. Likelihoods are taken to the
power of the inverse of the ratio before they are integrated (Pauli, Racugno and Ventura 2011). Scores are not corrected
for leverage: a member that acts in a few stretches alone has a ratio that is too small.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.observations.linear import stretch_sums

Array = NDArray[np.float64]


def tempered(log: float, cost: float, excess: float) -> float:
    """Log odds, the likelihood ratio to the power of 1 / `excess`; what priors and free numbers cost stays."""
    return (log + cost) / excess - cost


def excess_of_scatter(
    white: Array, target: Array, known: tuple[Array, Array], stretch: NDArray[np.int64], places: Sequence[slice]
) -> list[float]:
    """Variance of the coefficients along what is found of every member, by the sandwich over that by the noise; >= 1.

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
    scores = stretch_sums(white * (target - white @ found)[:, None], stretch)
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

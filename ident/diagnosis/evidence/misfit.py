"""Ratio of the sandwich variance to the variance by the noise, along each member of a set.

Where all hypotheses are a little wrong, the likelihood grows with the rows as if each of them was new. The sandwich
over stretches of rows (White 1982) is the variance of what is found whatever the noise is. Likelihoods are taken to the
power of the inverse of the ratio before they are integrated (Pauli, Racugno and Ventura 2011). What is fitted follows
the rows of a stretch that has much of a member: so residuals of a stretch are made as large as they would be without,
by the leverage of its rows, and the ratio is one in the mean where the noise is as it says (Bell and McCaffrey 2002).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.observations.linear import RANK, starts_of

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
    scores = _unbiased_scores(white, target - white @ found, np.asarray(inverse, dtype=np.float64), stretch)
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


def _unbiased_scores(white: Array, residual: Array, inverse: Array, stretch: NDArray[np.int64]) -> Array:
    """(J, k) sums of columns times residuals over every stretch, these over (1 - H)^(1/2), H its rows' leverage."""
    starts = starts_of(stretch)
    scores = np.zeros((len(starts), white.shape[1]))
    for number, (rows, left) in enumerate(
        zip(np.split(white, starts[1:]), np.split(residual, starts[1:]), strict=True)
    ):
        leverages, turn = np.linalg.eigh(rows @ inverse @ rows.T)
        # What a stretch alone tells leaves no residual there, and says nothing of the noise.
        free = 1 - leverages
        weight = np.where(free > RANK, 1 / np.sqrt(np.maximum(free, RANK)), 0.0)
        scores[number] = (left @ turn * weight) @ (turn.T @ rows)
    return scores

"""Ratio of the sandwich variance to the variance by the noise, along each member of a set.

Where all hypotheses are a little wrong, the likelihood grows with the rows as if each of them was new. The sandwich
over stretches of rows (White 1982) is the variance of what is found whatever the noise is. Likelihoods are taken to the
power of the inverse of the ratio before they are integrated (Pauli, Racugno and Ventura 2011). What is fitted follows
the rows of a stretch that has much of a member: so residuals of a stretch are made as large as they would be without,
by the leverage of its rows, and the ratio is one in the mean where the noise is as it says (Bell and McCaffrey 2002).
A member that few stretches have is told a ratio of few degrees of freedom, by accident anything: what is believed
beforehand, that the noise is as it says, counts beside it (scaled inverse chi-squared; Gelman et al. 2013, 2.6).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from ident.diagnosis.observations.linear import RANK, starts_of, with_known

Array = NDArray[np.float64]

BELIEVED: Final = 8.0
"""Degrees of freedom of what is believed of a ratio beforehand: squares along all names that act on forces, beside what
is there, are as likely by eight as by sixteen, and less by others (`examples/scatter_along_names.py`)."""


def tempered(log: float, cost: float, excess: float) -> float:
    """Log odds, the likelihood ratio to the power of 1 / `excess`; what priors and free numbers cost stays."""
    return (log + cost) / excess - cost


@dataclass(frozen=True)
class Scatter:
    """How rows scatter in a direction of the coefficients in which the variance is one by the noise.

    What is known otherwise, the priors included, or by a single stretch, is as uncertain as it says.

    Attributes:
        told: variance by the sandwich.
        expected: of it, were the noise as it says.
        freedom: degrees of freedom of what is told.
    """

    told: float
    expected: float
    freedom: float

    @property
    def excess(self) -> float:
        """Variance that is believed."""
        return self.variance(BELIEVED)

    def variance(self, believed: float) -> float:
        """Variance, at least one, if `believed` degrees of freedom say beforehand that it is that by the noise."""
        return max(1 + self.freedom / (believed + self.freedom) * (self.told - self.expected), 1.0)


def scatter_along(
    white: Array, target: Array, known: tuple[Array, Array], stretch: NDArray[np.int64], places: Sequence[slice]
) -> list[Scatter]:
    """How rows scatter along what is found of every member.

    Args:
        white: (n, k) rows in units of the noise, of coefficients of unit variance.
        target: (n,).
        known: (m, k) and (m,) rows beside those of the records, in standard deviations.
        stretch: (n,) number of the stretch that each row belongs to, rising.
        places: columns of every member.
    """
    whole, wanted = with_known(white, target, known)
    # Independent directions of the coefficients, of unit variance by the noise.
    rows, factor = np.linalg.qr(whole)
    basis = linalg.solve_triangular(factor, np.eye(len(factor)))
    amplitudes = rows.T @ wanted
    left, found = wanted - rows @ amplitudes, basis @ amplitudes
    sandwich = _Sandwich.of(rows[: len(target)], left[: len(target)], stretch)
    scatters = []
    for place in places:
        along = np.linalg.lstsq(basis[place], found[place], rcond=None)[0]
        scatters.append(sandwich.along(along / max(float(np.linalg.norm(along)), np.finfo(float).tiny)))
    return scatters


@dataclass(frozen=True)
class _Sandwich:
    """Stretches of rows, by independent coefficients of unit variance, as they are squared and summed.

    Attributes:
        rows: (m, k) of every stretch.
        weighted: the same over the square root of 1 - H, H their leverage.
        residuals: (m,).
    """

    rows: Sequence[Array]
    weighted: Sequence[Array]
    residuals: Sequence[Array]

    @classmethod
    def of(cls, rows: Array, residual: Array, stretch: NDArray[np.int64]) -> _Sandwich:
        """Of rows (n, k) and what is left of them (n,), by numbers of their stretches (n,)."""
        ends = starts_of(stretch)[1:]
        parts = np.split(rows, ends)
        return cls(parts, [_as_without_leverage(part) for part in parts], np.split(residual, ends))

    def along(self, direction: Array) -> Scatter:
        """In a direction (k,) of unit length, in which the variance is one by the noise."""
        weights = [weighted @ direction for weighted in self.weighted]
        told = sum(float(own @ left) ** 2 for own, left in zip(weights, self.residuals, strict=True))
        # Trace of the covariance of these sums, were the noise as it says, and that of its square.
        squares = np.array([float(own @ own) for own in weights])
        fitted = np.array([rows.T @ own for rows, own in zip(self.rows, weights, strict=True)])
        shared = np.sum(fitted**2, axis=1)
        expected = float(np.sum(squares - shared))
        square = float(np.sum(squares**2 - 2 * squares * shared) + np.sum((fitted.T @ fitted) ** 2))
        return Scatter(told, expected, expected**2 / square if square > 0 else 0.0)


def _as_without_leverage(rows: Array) -> Array:
    """Rows (m, k) of a stretch over (1 - H)^(1/2); nothing of what it alone tells, which leaves no residual."""
    leverages, turn = np.linalg.eigh(rows @ rows.T)
    free = 1 - leverages
    weight = np.where(free > RANK, 1 / np.sqrt(np.maximum(free, RANK)), 0.0)
    return np.asarray((turn * weight) @ (turn.T @ rows))

"""The curve of a law that was found, learnt from the rows.

The function is Gaussian beside the baseline and the effects taken, whose columns are projected out; its length and size
are those that make the fitted rows most likely (Rasmussen and Williams 2006, (5.8)), and are held for the confirming
ones. Its covariance is wider by as much as rows scatter more than the noise says.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from ident.diagnosis.dependence import Dependence, Variable
from ident.diagnosis.law.spline import Knots, knots_around, knots_over
from ident.diagnosis.observations.directions import VISIBLE
from ident.diagnosis.observations.linear import ROUNDING, orthonormal
from ident.diagnosis.observations.regression import Regression
from ident.diagnosis.observations.rows import Rows
from ident.diagnosis.observations.whitening import Whitening
from ident.diagnosis.problem import Problem

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

LENGTHS: Final = (1.0, 0.5, 0.25, 0.125, 0.07, 0.035)
"""Of a function that are tried, over the range of its variable; the last is what the knots resolve."""

SHORTEST_IN_TIME: Final = 0.07
"""Of a function of time, over the record: what is shorter follows the motion, and two records of one motion agree."""

SIZES: Final = tuple(np.logspace(0, 8, 17).tolist())
"""Of a function that are tried: power of its best direction over that of the noise."""


@dataclass(frozen=True)
class Learnt:
    """One dependence, learnt.

    Attributes:
        knots: of its function.
        weights: (K,) coefficients, learnt from the fitted rows alone.
        whole: (K,) the same from all rows.
        covariance: (K, K) of those.
    """

    knots: Knots
    weights: Array
    whole: Array
    covariance: Array


@dataclass(frozen=True)
class _Beside:
    """Whitened rows with the baseline and what is taken projected out, of some rows.

    Attributes:
        basis: (n, p) orthonormal, of what is projected out.
        residual: (n,) of the target.
    """

    basis: Array
    residual: Array

    def without(self, columns: Array) -> Array:
        """Columns (n, k) beside it."""
        return np.asarray(columns - self.basis @ (self.basis.T @ columns))


class Learner:
    """Learns dependences beside some variants that are taken."""

    def __init__(self, regression: Regression, whitener: Whitening, taken: Sequence[int]) -> None:
        rows = regression.rows
        self._whitener, self.rows = whitener, rows
        white = regression.white(whitener, tuple(taken), np.zeros((len(rows), 0)))
        self._target, self._model, self.fitted = white.target, white.baseline, ~white.confirming
        self._part, self._all = self._beside(self.fitted), self._beside(np.ones(len(self.fitted), dtype=bool))

    def learn(self, design: Array, knots: Knots, excess: float) -> Learnt | None:
        """A dependence; None where the fitted rows show nothing of it.

        Args:
            design: (n, K) its columns in the rows.
            knots: of its function.
            excess: by how much the rows scatter more than the noise says, as a ratio of variances.
        """
        white = self._white(design)
        part = _Moments.of(white[self.fitted], self._part)
        priors = [knots.prior(share) for share in LENGTHS if share >= knots.shortest]
        best, prior = max(((_fit(part, one), one) for one in priors), key=lambda found: found[0].log)
        if not best.log > 0:
            return None
        whole = _fit(_Moments.of(white, self._all), prior, best.size)
        turn = prior @ _beside_absorbed(white @ prior, whole.moments.columns @ prior)
        return Learnt(
            knots=knots,
            weights=turn @ best.mean,
            whole=turn @ whole.mean,
            covariance=excess * turn @ whole.covariance @ turn.T,
        )

    def _white(self, design: Array) -> Array:
        """Columns (n, K) as the rows have them; what is known of the parameters says nothing of a law."""
        known = np.zeros((len(self.fitted) - len(self.rows), design.shape[1]))
        return np.vstack([self._whitener.apply(self.rows, design), known])

    def _beside(self, chosen: Mask) -> _Beside:
        basis = orthonormal(self._model[chosen])
        target = self._target[chosen]
        return _Beside(basis, target - basis @ (basis.T @ target))


@dataclass(frozen=True)
class _Moments:
    """Columns (n, K) beside the baseline in some rows, and their products.

    Attributes:
        columns: (n, K).
        powers: (K, K) products of them.
        amplitudes: (K,) products of them and the residual.
    """

    columns: Array
    powers: Array
    amplitudes: Array

    @classmethod
    def of(cls, columns: Array, beside: _Beside) -> _Moments:
        """Those of whitened columns (n, K)."""
        left = beside.without(columns)
        return cls(left, left.T @ left, left.T @ beside.residual)


@dataclass(frozen=True)
class _Fit:
    """A function of one prior beside some rows.

    Attributes:
        size: power of the prior, over that of the noise.
        log: log evidence against no function.
        mean: (R,) coefficients in the directions of the prior.
        covariance: (R, R) of them.
        moments: of the rows.
    """

    size: float
    log: float
    mean: Array
    covariance: Array
    moments: _Moments


def _fit(moments: _Moments, prior: Array, size: float | None = None) -> _Fit:
    """The most likely size, or the one given, of a function with a prior (K, R)."""
    powers, turn = np.linalg.eigh(prior.T @ moments.powers @ prior)
    powers = np.maximum(powers, 0.0)
    amplitudes = turn.T @ (prior.T @ moments.amplitudes)
    largest = max(float(powers.max(initial=0.0)), np.finfo(float).tiny)
    sizes = np.array([size]) if size is not None else np.array(SIZES) / largest
    gains = sizes[:, None] / (1 + sizes[:, None] * powers)
    logs = 0.5 * np.sum(gains * amplitudes**2 - np.log1p(sizes[:, None] * powers), axis=1)
    best = int(np.argmax(logs))
    mean, covariance = turn @ (gains[best] * amplitudes), turn * gains[best] @ turn.T
    return _Fit(float(sizes[best]), float(logs[best]), mean, covariance, moments)


def _beside_absorbed(design: Array, left: Array) -> Array:
    """What takes the part off coefficients (R,) that the baseline absorbs: a constant, where that is the friction's.

    Args:
        design: (n, R) columns.
        left: (n, R) of them beside the baseline.
    """
    whole = design.T @ design
    size = np.sqrt(np.maximum(np.diag(whole), np.finfo(float).tiny))
    # Some of the columns may be the same.
    scaled = whole / np.outer(size, size) + ROUNDING * np.eye(len(whole))
    shares, turn = linalg.eigh(left.T @ left / np.outer(size, size), scaled)
    absorbed = turn[:, shares < VISIBLE**2] / size[:, None]
    # Orthonormal in the metric of the whole columns: what is taken off is what these rows cannot tell.
    return np.asarray(np.eye(len(whole)) - absorbed @ absorbed.T @ whole)


class Designs:
    """Columns of every dependence in the rows of some problems, made once.

    Args:
        problems: to fit and to confirm.
        rows: of them; those of the same problems with more candidates are the same.
    """

    def __init__(self, problems: Sequence[Problem], rows: Rows) -> None:
        self._rows, self._problems = rows, problems
        self._knots: dict[int, Knots | None] = {}
        self._columns: dict[int, Array] = {}

    def knots(self, index: int) -> Knots | None:
        """Of the function of a dependence; None where its variable hardly changes in the rows."""
        if index not in self._knots:
            self._knots[index] = _knots_of(self._parts(index), [kept.samples.ravel() for _, kept in self._rows.blocks])
        return self._knots[index]

    def columns(self, index: int) -> Array:
        """(n, K) of a dependence that has knots."""
        if index not in self._columns:
            knots = self.knots(index)
            assert knots is not None
            self._columns[index] = self._rows.stack(self.series(index), len(knots.places))
        return self._columns[index]

    def series(self, index: int) -> list[Array | None]:
        """The same of every block, all samples (N, K)."""
        knots = self.knots(index)
        assert knots is not None
        return [column for part in self._parts(index) for column in part.design(knots.basis)]

    def _parts(self, index: int) -> list[Dependence]:
        return [problem.dependences[index] for problem in self._problems]


def _knots_of(parts: Sequence[Dependence], samples: Sequence[NDArray[np.int64]]) -> Knots | None:
    """Knots over the range that the variable has in the rows used; None where it has none."""
    if parts[0].period:
        return knots_around(parts[0].period)
    arguments = [argument for part in parts for argument in part.arguments]
    used = [x[chosen] for x, chosen in zip(arguments, samples, strict=True) if x is not None and chosen.size]
    if not used:
        return None
    low, high = min(float(x.min()) for x in used), max(float(x.max()) for x in used)
    if high - low <= ROUNDING * max(abs(low), abs(high)):
        return None
    return knots_over(low, high, SHORTEST_IN_TIME if parts[0].variable is Variable.TIME else 0.0)

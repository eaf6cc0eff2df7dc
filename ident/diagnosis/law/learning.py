"""How well a smooth function explains the rows: its evidence, and its curve.

The function is Gaussian beside the baseline and the effects taken, whose columns are projected out; its length and size
are those that make the fitted rows most likely (Rasmussen and Williams 2006, (5.8)), and are held for the confirming
ones. Noise that remembers itself makes all evidence smaller by the factor by which it scatters (`evidence.scatter`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from ident.diagnosis.directions import VISIBLE
from ident.diagnosis.evidence import scatter
from ident.diagnosis.law.dependence import Dependence, Variable
from ident.diagnosis.law.spline import Knots, knots_around, knots_over
from ident.diagnosis.linear import orthonormal
from ident.diagnosis.problem import Problem
from ident.diagnosis.regression import Regression
from ident.diagnosis.rows import Rows
from ident.diagnosis.whitening import Whitening

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

LENGTHS: Final = (1.0, 0.5, 0.25, 0.125, 0.07, 0.035)
"""Of a function that are tried, over the range of its variable; the last is what the knots resolve."""

SHORTEST_IN_TIME: Final = 0.07
"""Of a function of time, over the record: what is shorter follows the motion, and two records of one motion agree."""

ROUNDING: Final = 1e-9
"""Range of a variable, relative to its size, from which it changes."""

RIDGE: Final = 1e-9
"""Of columns of unit length, where some of them are the same."""

SIZES: Final = tuple(np.logspace(0, 8, 17).tolist())
"""Of a function that are tried: power of its best direction over that of the noise."""


@dataclass(frozen=True)
class Learnt:
    """One dependence, learnt.

    Attributes:
        index: of the dependence in its problem.
        knots: of its function.
        log_evidence: of the fitted rows, against no function.
        log_predictive: what the confirming rows add to it.
        weights: (K,) coefficients, learnt from the fitted rows alone.
        whole: (K,) the same from all rows.
        covariance: (K, K) of those.
        shape: (n + known,) what it adds to the whitened rows beside the baseline, by all rows.
        scale: by which all evidence was divided, as the noise along the function scatters more than white noise.
    """

    index: int
    knots: Knots
    log_evidence: float
    log_predictive: float
    weights: Array
    whole: Array
    covariance: Array
    shape: Array
    scale: float

    def total(self, cost: float) -> float:
        """Log evidence of all rows, less that of a noise without a law by which `cost` more of them is explained."""
        return self.log_evidence + self.log_predictive - cost / self.scale


@dataclass(frozen=True)
class _Beside:
    """Whitened rows with the baseline and what is taken projected out, of some rows.

    Attributes:
        basis: (n, p) orthonormal, of what is projected out.
        residual: (n,) of the target.
        stretch: (n,) number of the stretch of noise that a row belongs to.
    """

    basis: Array
    residual: Array
    stretch: NDArray[np.int64]

    def without(self, columns: Array) -> Array:
        """Columns (n, k) beside it."""
        return np.asarray(columns - self.basis @ (self.basis.T @ columns))


class Learner:
    """Learns dependences beside some variants that are taken."""

    def __init__(self, regression: Regression, whitener: Whitening, taken: Sequence[int]) -> None:
        rows = regression.rows
        self._whitener, self.rows = whitener, rows
        white = regression.white(whitener, tuple(taken), np.zeros((len(rows), 0)))
        self._target, self._model, self._stretch = white.target, white.baseline, white.stretch
        self.fitted = ~white.confirming
        self._part, self._all = self._beside(self.fitted), self._beside(np.ones(len(self.fitted), dtype=bool))

    def learn(self, index: int, design: Array, knots: Knots) -> Learnt | None:
        """A dependence; None where the fitted rows show nothing of it.

        Args:
            index: of it in its problem.
            design: (n, K) its columns in the rows.
            knots: of its function.
        """
        white = self._white(design)
        part = _Moments.of(white[self.fitted], self._part)
        shares = [share for share in LENGTHS if share >= knots.shortest]
        best = max((_fit(part, knots.prior(share)) for share in shares), key=lambda fit: fit.log)
        if not best.log > 0:
            return None
        whole = _fit(_Moments.of(white, self._all), best.prior, best.size)
        scale = self._scale(best, whole)
        turn = best.prior @ _beside_absorbed(white @ best.prior, whole.moments.columns @ best.prior)
        return Learnt(
            index=index,
            knots=knots,
            log_evidence=best.log / scale,
            log_predictive=(whole.log - best.log) / scale,
            weights=turn @ best.mean,
            whole=turn @ whole.mean,
            covariance=scale * turn @ whole.covariance @ turn.T,
            shape=whole.shape,
            scale=scale,
        )

    def _scale(self, part: _Fit, whole: _Fit) -> float:
        """By how much the noise along the function scatters more than white noise would."""
        pairs = ((part.shape, self._part), (whole.shape, self._all))
        found = [
            scatter((shape / length)[:, None], beside.residual, beside.stretch)
            for shape, beside in pairs
            if (length := float(np.linalg.norm(shape))) > 0
        ]
        return max(found, default=1.0)

    def _white(self, design: Array) -> Array:
        """Columns (n, K) as the rows have them; what is known of the parameters says nothing of a law."""
        known = np.zeros((len(self.fitted) - len(self.rows), design.shape[1]))
        return np.vstack([self._whitener.apply(self.rows, design), known])

    def _beside(self, chosen: Mask) -> _Beside:
        basis = orthonormal(self._model[chosen])
        target = self._target[chosen]
        return _Beside(basis, target - basis @ (basis.T @ target), self._stretch[chosen])


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
        prior: (K, R) factor of its covariance.
        size: power of the prior, over that of the noise.
        log: log evidence against no function.
        mean: (R,) coefficients in the directions of the prior.
        covariance: (R, R) of them.
        moments: of the rows.
    """

    prior: Array
    size: float
    log: float
    mean: Array
    covariance: Array
    moments: _Moments

    @property
    def shape(self) -> Array:
        """What it adds to the rows (n,)."""
        return np.asarray(self.moments.columns @ (self.prior @ self.mean))


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
    mean = turn @ (gains[best] * amplitudes)
    return _Fit(prior, float(sizes[best]), float(logs[best]), mean, turn * gains[best] @ turn.T, moments)


def _beside_absorbed(design: Array, left: Array) -> Array:
    """What takes the part off coefficients (R,) that the baseline absorbs: a constant, where that is the friction's.

    Args:
        design: (n, R) columns.
        left: (n, R) of them beside the baseline.
    """
    whole = design.T @ design
    size = np.sqrt(np.maximum(np.diag(whole), np.finfo(float).tiny))
    scaled = whole / np.outer(size, size) + RIDGE * np.eye(len(whole))
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

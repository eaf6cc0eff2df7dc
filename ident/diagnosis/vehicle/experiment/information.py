"""What an experiment is expected to tell: by how much it will split what may stand in a place.

The information that rows are expected to bring (Lindley 1956) is the mutual information of hypotheses and rows. Where
these are Gaussian about means that differ by the hypothesis, it is at least

    -Σ_i p_i log Σ_j p_j exp(-d_ij² / 8)

(Kolchinsky and Tracey 2017, by Chernoff's divergence), d_ij² what j leaves of the mean by i, over the noise, the
parameters of the vehicle and the size of j being free. What the rows of the four steps split they have split already:
d_ij² is what further rows add to it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.observations.linear import least_squares
from ident.diagnosis.observations.rows import Column, Rows, make_rows
from ident.diagnosis.problem import Problem, contributions_of
from ident.diagnosis.vehicle.experiment.visibility import NEGLIGIBLE, RANK, row_noise

Array = NDArray[np.float64]

NOTHING: Final = ""
"""Key of no cause at all."""


def expected_information(probabilities: Array, separations: Array) -> float:
    """Least mutual information of hypotheses and rows [bit].

    Args:
        probabilities: (k,) of the hypotheses, that sum to one.
        separations: (k, k) squared, in units of the noise: what j leaves of the mean by i.
    """
    alike = np.exp(-separations / 8) @ probabilities
    return float(-probabilities @ np.log2(np.maximum(alike, np.finfo(float).tiny)))


@dataclass(frozen=True, eq=False)
class Imagined:
    """Ideal rows of the four steps, and behind them those of an experiment that could be driven further.

    Series of rows are in units of their noise, those of what is known of the baseline behind them: (n + m,).

    Attributes:
        four, further: problems of both, with the same candidates.
        parameters: (p,) of the vehicle.
    """

    four: Problem
    further: Problem
    parameters: Array

    def information(self, probabilities: Mapping[str, float], means: Mapping[str, Array]) -> float:
        """That the further rows are expected to bring on what stands in a place [bit].

        Args:
            probabilities: of every cause that may, by key, and of nothing; they sum to one.
            means: (n + m,) what each of them adds.
        """
        keys = list(probabilities)
        series = np.stack([means[key] for key in keys], axis=1)
        separations = np.stack([self._separations(series, key) for key in keys], axis=1)
        return expected_information(np.array([probabilities[key] for key in keys]), separations)

    def usual(self, key: str) -> Array:
        """(n + m,) what a cause of the size that it has in practice adds."""
        shown = [column for column in self._columns(key) if column.width]
        if not shown:
            return np.zeros(len(self._baseline))
        candidate, column = self.four.candidate(key), shown[0]
        unit = abs(float(candidate.variants[column.variant].numbers(np.eye(column.width)[0])[0]))
        return self._over_noise(self._rows.columns[:, column.place.start] * candidate.usual / unit)

    def found(self, key: str, values: Array) -> Array:
        """(n + m,) what the columns of a cause add that is as like as can be to it, by its parameters (k,).

        What these miss of its exact form would tell the cause from itself.
        """
        return self.like(self._exactly(key, values), key)

    def _exactly(self, key: str, values: Array) -> Array:
        both = [problem.candidate(key) for problem in (self.four, self.further)]
        if all(one.contribution is not None for one in both):
            return self._over_noise(self._rows.stack(contributions_of(both, values, self.parameters)))
        column = self._columns(key)[0]
        numbers = np.stack([both[0].variants[0].numbers(unit) for unit in np.eye(column.width)], axis=1)
        return self._over_noise(self._rows.columns[:, column.place] @ np.linalg.pinv(numbers) @ values)

    def like(self, mean: Array, key: str) -> Array:
        """(n + m,) what a cause adds that is, in the four steps, as like a mean (n + m,) as it can be."""
        best, least = np.zeros(len(mean)), np.inf
        for own in self._spaces(key):
            # Of what the four steps do not show they say nothing.
            norms = np.linalg.norm(own[self._old], axis=0), np.linalg.norm(own, axis=0)
            shown = own[:, norms[0] > NEGLIGIBLE * norms[1]]
            beside = np.hstack([self._baseline, shown])[self._old]
            found = least_squares(beside, mean[self._old])
            left = float(np.sum((mean[self._old] - beside @ found) ** 2))
            if left < least:
                best, least = shown @ found[self._baseline.shape[1] :], left
        return best

    def _separations(self, means: Array, key: str) -> Array:
        """(k,) what the further rows leave of means (n + m, k) by another cause, beyond what the four steps leave."""
        spaces = self._spaces(key) or [np.zeros((len(means), 0))]
        columns = [np.hstack([self._baseline, own]) for own in spaces]
        whole = np.min([_left_of(means, each) for each in columns], axis=0)
        old = np.min([_left_of(means[self._old], each[self._old]) for each in columns], axis=0)
        return np.asarray(np.maximum(whole - old, 0.0))

    def _spaces(self, key: str) -> list[Array]:
        """Columns (n + m, k) of every variant of a cause, without those that are rounding."""
        made = [self._over_noise(self._rows.columns[:, column.own]) for column in self._columns(key)]
        norms = [np.linalg.norm(own, axis=0) for own in made]
        return [own[:, norm > NEGLIGIBLE * norm.max(initial=0.0)] for own, norm in zip(made, norms, strict=True)]

    def _columns(self, key: str) -> list[Column]:
        """Of every variant of a cause; of nothing there are none."""
        return [column for column in self._rows.layout if self.four.candidates[column.candidate].key == key]

    def _over_noise(self, series: Array) -> Array:
        """Series (n, ...) in units of the noise, of which nothing is known beside the rows."""
        scaled = (series.T / self._noise).T
        return np.concatenate([scaled, np.zeros((len(self.four.known.places), *series.shape[1:]))])

    @cached_property
    def _rows(self) -> Rows:
        return make_rows(self.four, self.further)

    @cached_property
    def _noise(self) -> Array:
        return row_noise(self._rows)

    @cached_property
    def _old(self) -> NDArray[np.bool_]:
        """(n + m,) without the further rows."""
        return np.concatenate([~self._rows.confirming, np.ones(len(self.four.known.places), dtype=np.bool_)])

    @cached_property
    def _baseline(self) -> Array:
        known, found = self.four.known, self._over_noise(self._rows.baseline)
        found[np.ix_(len(self._rows) + np.arange(len(known.places)), known.places)] = known.precision
        return found


def _left_of(means: Array, columns: Array) -> Array:
    """(k,) power of means (N, k) that columns (N, w) leave: by products, as singular vectors take ten times as long."""
    scaled = columns / np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny)
    turned = scaled.T @ means
    found = np.linalg.pinv(scaled.T @ scaled, rcond=RANK**2, hermitian=True) @ turned
    return np.asarray(np.sum((means - scaled @ found) ** 2, axis=0))

"""What repeats and can be predicted, whether or not the library has a name for it.

A smooth function of the states of a coordinate (speeds, positions, accelerations), learnt on the rows of the fit from
what the model leaves, is tried on the confirming rows. If it predicts them, there is a gap that is no noise; how much
it predicts beyond the effects named says how much they leave unexplained.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.observations.linear import least_squares, stretch_sums
from ident.diagnosis.observations.regression import Regression
from ident.diagnosis.observations.rows import Rows
from ident.diagnosis.observations.whitening import Whitening

Array = NDArray[np.float64]

FUNCTIONS: Final = 80
"""Random cosines of the states (Rahimi and Recht 2007) a coordinate."""
REACH: Final = 1.0
"""Of the cosines, in standard deviations of the states."""
RIDGES: Final = tuple(10.0**power for power in range(-1, 6))


@dataclass(frozen=True)
class Generic:
    """What the smooth function does for the confirming rows.

    Attributes:
        deviations: by how many standard deviations the prediction agrees with what is left.
        prediction: (n,) of the function for all rows, not whitened; only what the model cannot absorb.
    """

    deviations: float
    prediction: Array


class SmoothFunction:
    """The function of the states beside whatever effects are taken; random by `seed`.

    Args:
        regression: rows that it is learnt and tried on.
        whitener: of what the effects found leave.
        seed: of the cosines.
    """

    def __init__(self, regression: Regression, whitener: Whitening, seed: int) -> None:
        self._regression, self._whitener = regression, whitener
        self._functions = _functions(regression.rows, seed)
        self._white = whitener.apply(regression.rows, self._functions)

    def beside(self, taken: tuple[int, ...]) -> Generic:
        """Learn it beside the baseline and the effects taken, on the fitted rows, and try it on the others."""
        regression, rows = self._regression, self._regression.rows
        design = np.hstack([rows.baseline, regression.fitted_columns_of(taken)])
        white = self._whitener.apply(rows, np.column_stack([design, rows.target - regression.found_of(taken)]))
        fitted = ~rows.confirming
        model, target = white[:, :-1], white[:, -1]
        left = target - model @ least_squares(model[fitted], target[fitted])
        absorbed = least_squares(model[fitted], self._white[fitted])
        extra = self._white - model @ absorbed
        weights = _ridge(extra[fitted], left[fitted], regression.stretch[fitted])
        predicted = extra @ weights
        confirming = rows.confirming
        products = stretch_sums(predicted[confirming] * left[confirming], regression.stretch[confirming])
        spread = float(np.sqrt(np.sum(products**2)))
        return Generic(
            deviations=float(products.sum()) / spread if spread > 0 else 0.0,
            prediction=self._functions @ weights - design @ (absorbed @ weights),
        )


def _functions(rows: Rows, seed: int) -> Array:
    """Random cosines (n, FUNCTIONS times coordinates) of the states, those of each coordinate apart."""
    labels = [(block.channel, block.coordinate) for block, _ in rows.blocks]
    stacks = []
    for label in dict.fromkeys(labels):
        states = [block.features if one == label else None for (block, _), one in zip(rows.blocks, labels, strict=True)]
        width = next((one.shape[1] for one in states if one is not None), 0)
        if width == 0:
            continue
        inside = rows.stack([None if one is None else np.ones(len(one)) for one in states]) > 0
        if inside.any():
            stacks.append(_cosines(rows.stack(states, width), inside, seed))
    return np.hstack([np.zeros((len(rows), 0)), *stacks])


def _cosines(states: Array, inside: NDArray[np.bool_], seed: int) -> Array:
    generator = np.random.default_rng(seed)
    own = states[inside]
    scaled = (own - own.mean(axis=0)) / np.maximum(own.std(axis=0), np.finfo(float).tiny)
    frequencies = generator.normal(size=(states.shape[1], FUNCTIONS)) / REACH
    phases = generator.uniform(0, 2 * np.pi, FUNCTIONS)
    values = np.zeros((len(states), FUNCTIONS))
    values[inside] = np.cos(scaled @ frequencies + phases)
    return values


class _Ridge:
    """Least squares of columns (n, F) with any ridge, at the price of one decomposition of the smaller side."""

    def __init__(self, columns: Array, target: Array) -> None:
        self._columns, self._wide = columns, columns.shape[0] < columns.shape[1]
        self._powers, self._turn = np.linalg.eigh(columns @ columns.T if self._wide else columns.T @ columns)
        self._amplitudes = self._turn.T @ (target if self._wide else columns.T @ target)

    def weights(self, ridge: float) -> Array:
        """Weights (F,) for a positive ridge."""
        found = self._turn @ (self._amplitudes / (np.maximum(self._powers, 0.0) + ridge))
        return np.asarray(self._columns.T @ found if self._wide else found)


def _ridge(extra: Array, left: Array, stretch: NDArray[np.int64]) -> Array:
    """Weights of the functions, the ridge by cross-validation over alternating stretches."""
    if extra.shape[1] == 0 or len(left) == 0:
        return np.zeros(extra.shape[1])
    fold = np.unique(stretch, return_inverse=True)[1] // 2 % 2
    halves = [(extra[fold == part], left[fold == part]) for part in (0, 1)]
    first, second = (_Ridge(*half) for half in halves)
    losses = [_loss(*halves[0], second.weights(ridge)) + _loss(*halves[1], first.weights(ridge)) for ridge in RIDGES]
    normal = extra.T @ extra + RIDGES[int(np.argmin(losses))] * np.eye(extra.shape[1])
    return np.asarray(np.linalg.solve(normal, extra.T @ left))


def _loss(extra: Array, left: Array, weights: Array) -> float:
    return float(np.sum((left - extra @ weights) ** 2))

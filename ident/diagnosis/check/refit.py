"""The joint refit of parameters and effects: exact where a candidate is nonlinear, with deviations that hold."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.check.unknowns import Unknown, unknown_of
from ident.diagnosis.observations.linear import least_squares, stretch_sums
from ident.diagnosis.observations.regression import Regression
from ident.diagnosis.observations.rows import Rows
from ident.diagnosis.observations.whitening import Whitening
from ident.diagnosis.problem import Candidate, Problem, Series, summed

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

MOST_STEPS: Final = 15
HALVINGS: Final = 6
DIFFERENCE: Final = 1e-4
"""Relative step of numerical derivatives."""
HELD: Final = 1e4
"""Weight of what is known of the baseline beforehand, over its standard deviations, where it is held."""
SETTLED: Final = 0.02
"""Decrease of the sum of squares, in units of the noise, from which the refit has settled: a seventh of a deviation."""


@dataclass(frozen=True)
class Part:
    """One effect in a refit.

    Attributes:
        key: of its candidate.
        values, std: of its parameters (k,).
        numbers: all of them (m,), those that come along with the parameters behind.
        scatter: standard deviations (m,) of those by the scatter of the rows alone.
        added: what it adds to every block, (N,), None where that is nothing.
    """

    key: str
    values: Array
    std: Array
    numbers: Array
    scatter: Array
    added: Series


@dataclass(frozen=True)
class Refit:
    """Everything fitted jointly.

    Attributes:
        baseline: of the model's parameters (p,).
        covariance: of those (p, p).
        parts: of the effects.
        blocks: model of the target of every block, (N,), all samples.
    """

    baseline: Array
    covariance: Array
    parts: tuple[Part, ...]
    blocks: tuple[Array, ...]

    @property
    def baseline_std(self) -> Array:
        """Standard deviations (p,) of the model's parameters."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))


def refit(
    problems: Sequence[Problem],
    regression: Regression,
    variants: Sequence[int],
    whitener: Whitening,
    rows: Mask,
    *,
    exact: bool = True,
    held: bool = False,
) -> Refit:
    """Gauss and Newton, damped, from the linear solution.

    Args:
        problems: to fit and to confirm, as the rows were made of.
        regression: their rows.
        variants: effects.
        whitener: weights of the rows.
        rows: (n,) which rows are fitted.
        exact: whether candidates with an exact form are refitted by it; if not, all are their columns.
        held: whether what is known of the baseline beforehand is taken to be exact.
    """
    model = _Model(problems, regression, variants, whitener, rows, exact=exact, held=held)
    return model.result(_descended(model) if model.nonlinear else model.start)


def _descended(model: _Model) -> Array:
    found, residual = model.start, model.residual(model.start)
    for _ in range(MOST_STEPS):
        step, cost = least_squares(model.jacobian(found), residual), float(residual @ residual)
        for halving in range(HALVINGS):
            tried = found + 0.5**halving * step
            left = model.residual(tried)
            if float(left @ left) < cost:
                break
        else:
            return found
        found, residual = tried, left
        # A step that was cut very short says nothing of what is left.
        if 2 * halving < HALVINGS and cost - float(left @ left) < SETTLED:
            return found
    return found


class _Model:
    """Residual of the whitened rows as a function of one vector: the baseline's parameters, then those of effects."""

    def __init__(
        self,
        problems: Sequence[Problem],
        regression: Regression,
        variants: Sequence[int],
        whitener: Whitening,
        chosen: Mask,
        *,
        exact: bool,
        held: bool,
    ) -> None:
        self._weight = HELD if held else 1.0
        self.regression, self.whitener, self.chosen = regression, whitener, chosen
        self.rows: Rows = regression.rows
        self.size = self.rows.baseline.shape[1]
        unexplained = self.rows.target - regression.found_of(variants)
        linear = self._linear(regression.fitted_columns_of(variants), unexplained)
        self.unknowns: list[Unknown] = []
        starts, taken = [(linear[: self.size], linear[: self.size])], self.size
        for variant in variants:
            column = self.rows.layout[variant]
            width = 0 if regression.was_found(variant) else column.width
            first = sum(len(one) for one, _ in starts)
            unknown, by_columns, found = unknown_of(problems, column, linear[taken : taken + width], first, exact)
            self.unknowns.append(unknown)
            starts.append((by_columns, found))
            taken += width
        self._kept: dict[int, tuple[bytes, Array]] = {}
        self.start = self._better(*(np.concatenate(one) for one in zip(*starts, strict=True)))

    @property
    def nonlinear(self) -> bool:
        return any(unknown.exact is not None and not unknown.is_settled for unknown in self.unknowns)

    def residual(self, values: Array) -> Array:
        """Whitened rows that are fitted, then what is known beforehand."""
        model = self.rows.baseline @ values[: self.size]
        for number in range(len(self.unknowns)):
            model = model + self._added(number, values)
        white = self.whitener.apply(self.rows, self.rows.target - model)[self.chosen]
        known = self._weight * self.regression.prior_residual(values[: self.size])
        return np.concatenate([white, known, *(-unknown.expected(values) for unknown in self.unknowns)])

    def jacobian(self, values: Array) -> Array:
        """Derivative of the model of the same rows, (n + prior, all values)."""
        columns = [self.rows.baseline, *(self._derivative(number, values) for number in range(len(self.unknowns)))]
        white = self.whitener.apply(self.rows, np.hstack(columns))[self.chosen]
        prior = self._weight * self.regression.prior_jacobian(white.shape[1])
        expected = [_gradient(unknown.expected, values) for unknown in self.unknowns if len(unknown.expected(values))]
        return np.vstack([white, prior, *expected])

    def result(self, values: Array) -> Refit:
        """Parameters with standard deviations, and the model of every block."""
        covariance = self._covariance(values)
        blocks = [block.baseline @ values[: self.size] for block, _ in self.rows.blocks]
        parts = []
        for unknown in self.unknowns:
            own = values[unknown.place]
            series = self._series(unknown, own, values)
            blocks = [model if one is None else model + one for model, one in zip(blocks, series, strict=True)]
            turn = _gradient(unknown.finish, own)
            spread = turn @ covariance[unknown.place, unknown.place] @ turn.T
            deviations, numbers = np.sqrt(np.maximum(np.diag(spread), 0.0)), unknown.finish(own)
            stated = slice(len(unknown.candidate.parameters))
            total = np.hypot(deviations[stated], _beyond(unknown.candidate, numbers))
            parts.append(Part(unknown.candidate.key, numbers[stated], total, numbers, deviations, tuple(series)))
        return Refit(values[: self.size], covariance[: self.size, : self.size], tuple(parts), tuple(blocks))

    def _better(self, by_columns: Array, found: Array) -> Array:
        """All values to begin with: by columns, or those found before, the baseline fitted beside, if those leave less.

        What the rows fitted do not tell is not taken from what other rows told.
        """
        if np.array_equal(by_columns, found):
            return by_columns
        added = sum((self._added(number, found) for number in range(len(self.unknowns))), np.zeros(len(self.rows)))
        baseline = self._linear(np.zeros((len(self.rows), 0)), self.rows.target - added)
        beside = np.concatenate([baseline, found[self.size :]])
        left = [float(np.sum(self.residual(one) ** 2)) for one in (by_columns, beside)]
        return beside if left[1] < left[0] or not np.isfinite(left[0]) else by_columns

    def _linear(self, columns: Array, target: Array) -> Array:
        design = np.hstack([self.rows.baseline, columns])
        white = self.whitener.apply(self.rows, np.column_stack([design, target]))[self.chosen]
        prior = self._weight * self.regression.prior_jacobian(design.shape[1])
        known = self._weight * self.regression.prior_residual(np.zeros(self.size))
        return least_squares(np.vstack([white[:, :-1], prior]), np.append(white[:, -1], known))

    def _added(self, number: int, values: Array) -> Array:
        """What one effect adds to the rows; the last is kept, for the next derivative is taken there."""
        unknown, asked = self.unknowns[number], values.tobytes()
        kept = self._kept.get(number)
        if kept is None or kept[0] != asked:
            kept = asked, self.rows.stack(self._series(unknown, values[unknown.place], values))
            self._kept[number] = kept
        return kept[1]

    def _series(self, unknown: Unknown, own: Array, values: Array) -> Series:
        """What an effect of some numbers adds to every block, and makes of the forces of others, of those in `values`.

        What turns others is not turned.
        """
        baseline = values[: self.size]
        series = unknown.series(own, baseline)
        if unknown.turned is None:
            return series
        forces = [one.forces(values[one.place], baseline) for one in self.unknowns if one.has_force]
        return summed([series, unknown.turned(own, summed(forces))]) if forces else series

    def _derivative(self, number: int, values: Array) -> Array:
        own = self._own_derivative(number, values)
        turning = [one for one in self.unknowns if one.turned is not None]
        return own + self._turned_derivative(number, values, turning) if turning else own

    def _turned_derivative(self, number: int, values: Array, turning: Sequence[Unknown]) -> Array:
        """Derivative of what others make of the force of one effect."""
        unknown, baseline = self.unknowns[number], values[: self.size]
        own, columns = values[unknown.place], []
        if not unknown.has_force:
            return np.zeros((len(self.rows), len(own)))
        here = unknown.forces(own, baseline)
        for index, step in enumerate(_steps(own)):
            ahead = own.copy()
            ahead[index] += step
            change = [
                None if one is None or other is None else (one - other) / step
                for one, other in zip(unknown.forces(ahead, baseline), here, strict=True)
            ]
            turned = [one.turned(values[one.place], change) for one in turning if one.turned is not None]
            columns.append(self.rows.stack(summed(turned)))
        return np.stack(columns, axis=1)

    def _own_derivative(self, number: int, values: Array) -> Array:
        unknown = self.unknowns[number]
        own = values[unknown.place]
        if unknown.exact is None:
            return self.rows.stack(unknown.columns, len(own))
        here, derivative = self._added(number, values), np.zeros((len(self.rows), len(own)))
        for index, step in enumerate(_steps(own)):
            ahead = own.copy()
            ahead[index] += step
            derivative[:, index] = (self.rows.stack(self._series(unknown, ahead, values)) - here) / step
        return derivative

    def _covariance(self, values: Array) -> Array:
        """Sandwich over the stretches of rows, nowhere below what white rows would give."""
        jacobian, residual = self.jacobian(values), self.residual(values)
        scale = np.linalg.norm(jacobian, axis=0)
        scale[scale == 0] = 1.0
        inverse = np.linalg.pinv(jacobian.T / scale[:, None] @ (jacobian / scale), rcond=1e-12, hermitian=True)
        stretch = self.regression.stretch[self.chosen]
        scaled = jacobian / scale
        scores = scaled[: len(stretch)] * residual[: len(stretch), None]
        sums = stretch_sums(scores, stretch)
        freedom = len(sums) / max(len(sums) - 1, 1)
        # Squares, so that what rows hardly split gets no negative variance by rounding.
        spread, held = sums @ inverse, scaled[len(stretch) :] @ inverse
        robust = freedom * spread.T @ spread + held.T @ held
        found, least = np.diag(robust).copy(), np.diag(inverse)
        lift = np.sqrt(np.maximum(np.divide(least, found, out=np.ones_like(found), where=found > 0), 1.0))
        robust *= np.outer(lift, lift)
        np.fill_diagonal(robust, np.maximum(found, least))
        return np.asarray(robust / np.outer(scale, scale))


def _beyond(candidate: Candidate, numbers: Array) -> Array:
    """Standard deviations of the parameters (k,) beyond the scatter of the rows, from all numbers (m,)."""
    count = len(candidate.parameters)
    along = numbers[count:]
    alone = np.hypot(candidate.spread or 0.0, candidate.part * numbers[:count])
    return np.asarray(np.hypot(alone, candidate.yielding * np.linalg.norm(along)))


def _steps(values: Array) -> list[float]:
    return [max(DIFFERENCE * abs(float(value)), 1e-9) for value in values]


def _gradient(function: Callable[[Array], Array], values: Array) -> Array:
    """Numerical derivative (n, k)."""
    derivative = np.zeros((len(function(values)), len(values)))
    for index, step in enumerate(_steps(values)):
        ahead, behind = values.copy(), values.copy()
        ahead[index] += step
        behind[index] -= step
        derivative[:, index] = (np.asarray(function(ahead)) - np.asarray(function(behind))) / (2 * step)
    return derivative

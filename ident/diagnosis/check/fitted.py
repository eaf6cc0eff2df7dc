"""The model without and with the effects of a search, by all rows and by those not held out, and what each closes."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.check.generic import SmoothFunction
from ident.diagnosis.check.refit import Refit, refit
from ident.diagnosis.check.remainder import Told, held_out_gap, held_out_gap_of_means, noise_floors
from ident.diagnosis.diagnosis import Gap
from ident.diagnosis.observations.linear import least_squares
from ident.diagnosis.observations.regression import Regression
from ident.diagnosis.observations.whitening import Predictor, Whitener, Whitening
from ident.diagnosis.problem import Candidate, Problem

Array = NDArray[np.float64]

BLUR: Final = 0.5
"""Part of the noise's power that no member is asked to come nearer to the rows than without it."""


@dataclass(frozen=True)
class HeldOut:
    """What was fitted without the confirming rows, and the problem that they come from.

    Attributes:
        problem: that confirms.
        plain, extended: refits without and with the causes.
        before, after: models (N,) of every block of `problem`; before is the model that was given, or that refit.
    """

    problem: Problem
    plain: Refit
    extended: Refit
    before: tuple[Array, ...]
    after: tuple[Array, ...]


@dataclass(frozen=True)
class Taken:
    """Effects that an answer consists of.

    Attributes:
        variants: of them.
        whitener: of what they leave.
    """

    variants: tuple[int, ...]
    whitener: Whitening


class Fitted:
    """The model without and with the effects that a search has ended with.

    Attributes:
        rows: of both problems.
        rest: what a smooth function of the states predicts of what is left with the effects.
        before, after: refits of all rows.
        floors: rms of the noise of every block.
        untouched: (N,) of every block, the model without effects that held-out rows are compared with.
        told: samples (N,) of every block in which laws are within what the fitted rows have shown; empty without laws.
            Held out, nothing is asked elsewhere.
    """

    def __init__(
        self, problems: Sequence[Problem], regression: Regression, found: Taken, seed: int, told: Told = ()
    ) -> None:
        self.problems, self.regression, self.found, self.told = problems, regression, found, told
        self._kept: dict[tuple[tuple[int, ...], bool], Refit] = {}
        self.rows = regression.rows
        self._weights = _weights(regression, found)
        smooth = SmoothFunction(regression, found.whitener, seed)
        self.rest = smooth.beside(found.variants)
        self.after, self.before = self._refit(found.variants), self._refit(())
        left = self.rows.target - self.rows.stack(list(self.after.blocks)) - self.rest.prediction
        self.floors = noise_floors(self.rows, self.after.blocks, left)
        self.untouched = self._held_out_models(())

    @property
    def count(self) -> int:
        """Number of the effects."""
        return len(self.found.variants)

    def candidate(self, index: int) -> Candidate:
        """That an effect is a variant of."""
        return self.problems[0].candidates[self.regression.owners[self.found.variants[index]]]

    def reached_by(self, index: int) -> frozenset[str]:
        """Labels of the blocks in which one effect acts."""
        column = self.rows.layout[self.found.variants[index]]
        return frozenset(
            block.label
            for problem in self.problems
            for block, acting in zip(
                problem.blocks, problem.candidates[column.candidate].variants[column.variant].columns, strict=True
            )
            if acting is not None
        )

    def others(self, index: int) -> tuple[int, ...]:
        """The variants without that of one effect."""
        return tuple(other for place, other in enumerate(self.found.variants) if place != index)

    def judged(self) -> Sequence[Array]:
        """The model that is judged: as given, or refitted to all records."""
        nominal = self.problems[0].nominal
        if nominal is None:
            return self.before.blocks
        return [block.baseline @ nominal.values for block, _ in self.rows.blocks]

    @cached_property
    def exactly(self) -> Gap:
        """With all effects, as their exact forms."""
        return held_out_gap(self.rows, self.floors, self.untouched, self._extended_models, self.told)

    @cached_property
    def settled(self) -> Gap:
        """The same where there are no effects, beside what the fit leaves open of the baseline."""
        return self.exactly if self._is_given else self.beside_what_is_known

    @cached_property
    def beside_what_is_known(self) -> Gap:
        """The same, values of a model that is judged within what is known of them."""
        if self.found.variants:
            return self.exactly
        models = self._settled(self.held_out_refit(()))
        return held_out_gap(self.rows, self.floors, models, models, self.told)

    @cached_property
    def whole(self) -> Gap:
        """With all effects, as their columns."""
        return self.gap(self.found.variants)

    @property
    def removable(self) -> float:
        """Power of the held-out gap above the noise."""
        return self.whole.before**2 - self.whole.floor**2

    @cached_property
    def closed(self) -> list[float]:
        """Share of the removable held-out gap that each effect closes, all else refitted without it, as columns.

        What a refit can do without an effect is no reason for it.
        """
        without = [self.gap(self.others(index)).after for index in range(self.count)]
        return [_share(self.whole, after) for after in without]

    @cached_property
    def lacking(self) -> list[float]:
        """The same of the means over the repeats where the effect acts, the values of a judged model held.

        It is what is written of an effect; whether one beside others is worth its place is judged by it.
        """
        return [self._lacking(index) for index in range(self.count)]

    def _lacking(self, index: int) -> float:
        """Of what is left without it, where that is more than without any: effects can make up for each other."""
        whole, without = self._where_it_acts(index, held=self._is_given)
        above = replace(whole, before=max(whole.before, without), after=max(whole.after, whole.floor))
        return _share(above, without)

    def gap(self, variants: Sequence[int]) -> Gap:
        """Held-out gap with some effects, as their columns."""
        return held_out_gap(self.rows, self.floors, self.untouched, self._held_out_models(variants), self.told)

    def _gap_of_means(
        self, variants: Sequence[int], *, held: bool = False, labels: Collection[str] | None = None
    ) -> Gap:
        """The same of the means over the repeats; `held`: what is known of the baseline is taken as exact."""
        models = self._held_out_models(variants, held=held)
        return held_out_gap_of_means(self.rows, self.floors, self.untouched, models, labels, self.told)

    def gain(self, index: int) -> float:
        """Log of what is above the noise, and `BLUR` of it, without an effect over the same with it; where it acts.

        Held out, of the means over the repeats, the values of a judged model held. What a greater effect beside it
        closes does not count.
        """
        whole, without = self._where_it_acts(index, held=self._is_given)
        above = [max(after**2 - whole.floor**2, 0.0) + BLUR for after in (without, whole.after)]
        return math.log(above[0] / above[1]) / 2

    def _where_it_acts(self, index: int, *, held: bool = False) -> tuple[Gap, float]:
        """Gap of the means over the repeats where an effect acts, and what it is without it; `held` as above."""
        labels = self.reached_by(index)
        whole = self._gap_of_means(self.found.variants, labels=labels)
        return whole, self._gap_of_means(self.others(index), held=held, labels=labels).after

    def held_out(self) -> HeldOut:
        """What was fitted without the confirming rows."""
        confirming = slice(len(self.problems[0].blocks), None)
        before, after = (tuple(models[confirming]) for models in (self.untouched, self._extended_models))
        return HeldOut(self.problems[1], self.held_out_refit(()), self._extended, before, after)

    def biased(self, index: int) -> Mapping[str, float]:
        """Shift of every parameter when an effect is left out, in standard deviations."""
        without, whole = (self._refit(variants, exact=False) for variants in (self.others(index), self.found.variants))
        shift = (without.baseline - whole.baseline) / np.maximum(whole.baseline_std, np.finfo(float).tiny)
        return dict(zip(self.problems[0].names, shift.tolist(), strict=True))

    def _refit(self, variants: Sequence[int], *, exact: bool = True) -> Refit:
        everything = np.ones(len(self.rows), dtype=bool)
        return refit(self.problems, self.regression, variants, self.found.whitener, everything, exact=exact)

    @property
    def _is_given(self) -> bool:
        return self.problems[0].nominal is not None

    def _held_out_models(self, variants: Sequence[int], *, held: bool = False) -> Sequence[Array]:
        """Models of all blocks, fitted without the confirming rows."""
        if not variants and self._is_given:
            return self.judged()
        return self.held_out_refit(variants, held=held).blocks

    def _settled(self, found: Refit) -> Sequence[Array]:
        """Models of all blocks, the baseline in confirming ones moved as they ask, within what the fit leaves open.

        A record of one speed does not tell viscous friction from dry one, and says nothing of another speed.
        """
        rows, confirming = self.rows, self.rows.confirming
        powers, turn = np.linalg.eigh(found.covariance)
        known = powers > np.finfo(float).eps * powers.max(initial=0.0)
        axes, deviations = turn[:, known], np.sqrt(powers[known])
        left = rows.target - rows.stack(list(found.blocks))
        white = self._weights.apply(rows, np.column_stack([rows.baseline @ axes, left]))[confirming]
        asked = np.append(white[:, -1], np.zeros(len(deviations)))
        moved = axes @ least_squares(np.vstack([white[:, :-1], np.diag(1 / deviations)]), asked)
        first = len(self.problems[0].blocks)
        return [
            model + (block.baseline @ moved if index >= first else 0.0)
            for index, ((block, _), model) in enumerate(zip(rows.blocks, found.blocks, strict=True))
        ]

    def held_out_refit(self, variants: Sequence[int], *, held: bool = False) -> Refit:
        """With some effects, as their columns, without the confirming rows; several questions need the same one."""
        key = tuple(variants), held
        if key not in self._kept:
            self._kept[key] = self._fitted_to_others(variants, exact=False, held=held)
        return self._kept[key]

    @cached_property
    def _extended(self) -> Refit:
        """With all effects, as their exact forms, without the confirming rows."""
        return self._fitted_to_others(self.found.variants, exact=True, held=False)

    def _fitted_to_others(self, variants: Sequence[int], *, exact: bool, held: bool) -> Refit:
        """Fitted without the confirming rows, every coordinate in units of its residual."""
        fitted = ~self.rows.confirming
        return refit(self.problems, self.regression, variants, self._weights, fitted, exact=exact, held=held)

    @property
    def _extended_models(self) -> Sequence[Array]:
        return self._extended.blocks if self.found.variants else self.untouched


def _share(whole: Gap, without: float) -> float:
    """Of the removable gap that goes when what leaves a gap `without` it is added; 0 where nothing is removable."""
    removable = whole.before**2 - whole.floor**2
    return (without**2 - whole.after**2) / removable if removable > 0 else 0.0


def _weights(regression: Regression, found: Taken) -> Whitener:
    """Every group of rows in units of the rms of what the search leaves of it, no colour."""
    rows = regression.rows
    design = np.hstack([rows.baseline, regression.columns_of(found.variants)])
    white = found.whitener.apply(rows, np.column_stack([design, rows.target]))
    residual = rows.target - design @ least_squares(white[:, :-1], white[:, -1])
    _, first = np.unique(rows.group, return_index=True)
    return Whitener(tuple(Predictor((np.zeros(0),), np.array([one])) for one in rows.levels(residual)[first]))

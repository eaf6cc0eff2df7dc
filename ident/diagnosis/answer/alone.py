"""How much of the held-out gap each other name would close, were it the answer: what a wrong cause is worth."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.answer.findings import Findings
from ident.diagnosis.check.remainder import held_out_gap, noise_floors
from ident.diagnosis.observations.linear import least_squares
from ident.diagnosis.observations.rows import Column, Rows, make_rows
from ident.diagnosis.problem import Problem

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Alone:
    """A cause fitted alone, in place of the answer, by its columns.

    Attributes:
        name, where: which; of all places of a name, the one that fits best.
        refitted: share of the removable held-out gap closed, the model's parameters refitted before and after; NaN
            for a changed parameter, which such a refit absorbs.
        held: the same, the parameters held at the model's values; NaN without a model.
    """

    name: str
    where: str
    refitted: float
    held: float


def closed_alone(findings: Findings, problems: Sequence[Problem], keys: Collection[str] = ()) -> tuple[Alone, ...]:
    """Every name alone, at the place at which it fits the records best, and the causes in `keys` at theirs.

    Args:
        findings: of a diagnosis; what it leaves gives the weights and the noise.
        problems: to fit and to confirm, with all candidates.
        keys: causes that stand for their name.
    """
    trial = _Trial(findings, problems)
    candidates = problems[0].candidates
    given = {key.partition("@")[0] for key in keys}
    found: list[Alone] = []
    for name in dict.fromkeys(str(candidate.effect) for candidate in candidates):
        chosen = [
            column
            for column in trial.rows.layout
            if (candidate := candidates[column.candidate]).effect == name
            and (name not in given or candidate.key in keys)
            and column.width > 0
        ]
        if chosen:
            found.append(trial.alone(chosen))
    return tuple(found)


class _Trial:
    """Rows of a diagnosis, each coordinate in units of what the answer leaves of it."""

    def __init__(self, findings: Findings, problems: Sequence[Problem]) -> None:
        self.problems = problems
        self.rows: Rows = make_rows(*problems)
        left = self.rows.target - self.rows.stack(list(findings.after.blocks))
        self.floors = noise_floors(self.rows, findings.after.blocks, left)
        self.fitted = ~self.rows.confirming
        self.weight = 1 / self.rows.levels(left)[self.fitted]
        self.nominal = problems[0].nominal

    def alone(self, columns: Sequence[Column]) -> Alone:
        """The best of some variants of one name."""
        candidate = self.problems[0].candidates[columns[0].candidate]
        no_model, baseline = np.zeros(self.rows.baseline.shape[1]), self.rows.baseline
        refitted, best = (math.nan, columns[0]) if candidate.drift else self._closed(columns, no_model, baseline)
        held = math.nan
        if self.nominal is not None:
            held, best_held = self._closed(columns, self.nominal.values, baseline[:, :0])
            best = best_held if candidate.drift else best
        where = self.problems[0].candidates[best.candidate].where
        return Alone(str(candidate.effect), where, refitted, held)

    def _closed(self, columns: Sequence[Column], offset: Array, free: Array) -> tuple[float, Column]:
        """Share closed by the best variant, beside the columns that are `free`, from parameters `offset` on."""
        target = (self.rows.target - self.rows.baseline @ offset)[self.fitted] * self.weight
        beside = free[self.fitted] * self.weight[:, None]
        fits = [self._fit(column, target, beside) for column in columns]
        best = int(np.argmin([cost for cost, _ in fits]))
        column, (_, values) = columns[best], fits[best]
        width = free.shape[1]
        without = least_squares(beside, target) if width else np.zeros(0)
        before = self._models(offset, without, column, np.zeros(len(values) - width))
        after = self._models(offset, values[:width], column, values[width:])
        return held_out_gap(self.rows, self.floors, before, after).closed, column

    def _fit(self, column: Column, target: Array, beside: Array) -> tuple[float, Array]:
        """Sum of squares and coefficients, those of the variant last; nothing where it would have the wrong sign."""
        own = self.rows.columns[self.fitted, column.place] * self.weight[:, None]
        values = least_squares(np.hstack([beside, own]), target)
        if own.shape[1] == 1 and values[-1] < column.least:
            values = np.append(least_squares(beside, target) if beside.shape[1] else np.zeros(0), 0.0)
        left = target - np.hstack([beside, own]) @ values
        return float(left @ left), values

    def _models(self, offset: Array, refitted: Array, column: Column, own: Array) -> list[Array]:
        """Model of every block: parameters, then the columns of one variant."""
        parameters = offset if not refitted.size else refitted
        series = [
            part
            for problem in self.problems
            for part in problem.candidates[column.candidate].variants[column.variant].columns
        ]
        return [
            block.baseline @ parameters + (0.0 if part is None else part @ own)
            for (block, _), part in zip(self.rows.blocks, series, strict=True)
        ]

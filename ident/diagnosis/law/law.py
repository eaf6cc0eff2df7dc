"""A law that was found, as one more candidate of its problems."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.dependence import Dependence
from ident.diagnosis.law.learning import Learnt
from ident.diagnosis.observations.regression import Regression
from ident.diagnosis.observations.rows import Column
from ident.diagnosis.problem import Candidate, Problem, Variant
from ident.effects import EffectParameter

Array = NDArray[np.float64]

SCALE: Final = EffectParameter("scale", "1", "of the law as it was learnt")
"""The one number that a law has in a refit."""


@dataclass(frozen=True)
class Law:
    """A law that was found.

    Attributes:
        dependence: on what, and where.
        index: of the dependence in its problem.
        learnt: its function.
        number: of its candidate.
    """

    dependence: Dependence
    index: int
    learnt: Learnt
    number: int


def with_law(
    problems: Sequence[Problem], regression: Regression, law: Law
) -> tuple[tuple[Problem, ...], Regression, int]:
    """The problems and their rows with the law as one more candidate, and the number of its variant."""
    changed: list[Problem] = []
    series: list[Array | None] = []
    for problem in problems:
        design = problem.dependences[law.index].design(law.learnt.knots.basis)
        columns = tuple(None if one is None else (one @ law.learnt.weights)[:, None] for one in design)
        series += columns
        variants = (Variant(columns),)
        candidate = Candidate(law.dependence.effect, law.dependence.where, (SCALE,), variants, least=0.0)
        changed.append(replace(problem, candidates=(*problem.candidates, candidate)))
    rows = regression.rows
    end = rows.columns.shape[1]
    column = Column(law.number, 0, slice(end, end + 1), 0.0, (0.0, 0.0))
    wider = replace(rows, columns=np.hstack([rows.columns, rows.stack(series, 1)]), layout=(*rows.layout, column))
    return tuple(changed), Regression(changed[0], wider), len(rows.layout)

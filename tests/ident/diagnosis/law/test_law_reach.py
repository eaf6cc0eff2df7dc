"""A law is told where the fitted rows have shown its variable, and nowhere else."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ident.diagnosis.dependence import Basis, Dependence, Partner, Variable
from ident.diagnosis.law.reach import told_samples
from ident.diagnosis.observations.rows import make_rows
from ident.diagnosis.problem import Problem


def _with_law(problem: Problem, low: float, high: float, period: float = 0.0) -> Problem:
    x = [np.linspace(low, high, len(block.target))[:, None] for block in problem.blocks]

    def design(basis: Basis, *, apart: bool = False) -> list[None]:
        return []

    law = Dependence("place", Variable.ANGLE, Partner.NOTHING, "rad", "Nm", tuple(x), design, period=period)
    return replace(problem, dependences=(law,))


def test_beyond_what_was_fitted_nothing_is_told(world: type[Any]) -> None:
    problems = [_with_law(world(seed=3).problem(0), -1.0, 0.5), _with_law(world(seed=3).problem(1), 0.0, 1.0)]
    rows = make_rows(*problems)
    told = told_samples(rows, problems, ["law_angle@place"])
    count = len(problems[0].blocks)
    confirming = np.linspace(0.0, 1.0, len(problems[1].blocks[0].target))
    for mask in told[count:]:
        assert np.abs(confirming[mask].max() - 0.5) < 0.01
        assert mask[confirming < 0.49].all()
        assert not mask[confirming > 0.51].any()


def test_what_comes_around_is_told_everywhere(world: type[Any]) -> None:
    problems = [_with_law(world(seed=3).problem(part), -1.0, 9.0 * part, period=1.0) for part in (0, 1)]
    assert all(mask.all() for mask in told_samples(make_rows(*problems), problems, ["law_angle@place"]))


def test_without_laws_there_is_nothing_to_ask(world: type[Any]) -> None:
    problems = [world(seed=3).problem(part) for part in (0, 1)]
    assert told_samples(make_rows(*problems), problems, []) == ()

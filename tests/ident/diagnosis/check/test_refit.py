"""The joint refit finds what a general minimiser finds, where an effect is nonlinear and depends on the baseline."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ident.diagnosis.check.refit import MOST_STEPS, Refit, refit
from ident.diagnosis.observations.regression import Regression
from ident.diagnosis.observations.rows import make_rows
from ident.diagnosis.observations.whitening import Whitener
from ident.diagnosis.problem import Candidate, Problem, Variant
from ident.effects import EffectParameter

Array = NDArray[np.float64]
Form = Callable[[Array, Array], list[Array | None]]

TRUTH = np.array([1.0, -2.0, 0.5])
SIZE = 0.8
CURVED = 0.5
"""Of the column that only the square of the size moves: a linear start is far off."""


def form_of(problem: Problem, calls: list[bytes]) -> Form:
    """s a + s² p₁ b / 2 over the columns of two effects, p₁ being of the baseline; every call is noted."""
    straight, curved = (problem.candidate(f"{name}@place").variants[0].columns for name in ("a", "b"))

    def form(values: Array, baseline: Array) -> list[Array | None]:
        calls.append(values.tobytes() + baseline.tobytes())
        s = float(values[0])
        pairs = [(one, two) for one, two in zip(straight, curved, strict=True) if one is not None and two is not None]
        return [s * one[:, 0] + CURVED * s**2 * float(baseline[1]) * two[:, 0] for one, two in pairs]

    return form


def bent(problem: Problem, calls: list[bytes], *, spread: float = 0.0, part: float = 0.0) -> Problem:
    """The problem with that effect in its target, first among its candidates."""
    form = form_of(problem, calls)
    added = form(np.array([SIZE]), TRUTH)
    blocks = [
        replace(b, target=b.target + (0.0 if a is None else a)) for b, a in zip(problem.blocks, added, strict=True)
    ]
    straight = Variant(problem.candidates[0].variants[0].columns)
    parameters = (EffectParameter("size", "Nm", ""),)
    first = Candidate("a", "place", parameters, (straight,), form, spread=(spread,) if spread else (), part=part)
    return replace(problem, blocks=tuple(blocks), candidates=(first, *problem.candidates[1:]))


def whitener_of(regression: Regression) -> Whitener:
    return regression.colour_beside(regression.columns_of((0,)))


def refitted(problems: list[Problem]) -> tuple[Refit, Array, Regression]:
    """Its answer, the whitened rows of target and model, and what they were made with."""
    regression = Regression(problems[0], make_rows(*problems))
    whitener = whitener_of(regression)
    found = refit(problems, regression, (0,), whitener, np.ones(len(regression.rows), dtype=bool))
    left = regression.rows.target - regression.rows.stack(list(found.blocks))
    return found, whitener.apply(regression.rows, left[:, None])[:, 0], regression


def test_it_ends_where_a_general_minimiser_does(world: type[Any]) -> None:
    calls: list[bytes] = []
    problems = [bent(world(seed=3).problem(part), calls) for part in (0, 1)]
    found, left, regression = refitted(problems)
    rows, whitener = regression.rows, whitener_of(regression)
    forms = [problem.candidates[0].contribution for problem in problems]

    def residual(values: Array) -> Array:
        added = [one for form in forms if form is not None for one in form(values[3:], values[:3])]
        model = rows.baseline @ values[:3] + rows.stack(added)
        return np.asarray(whitener.apply(rows, (rows.target - model)[:, None])[:, 0])

    best = least_squares(residual, [*TRUTH, SIZE])
    # A step that would gain a seventh of a deviation is not taken any more.
    assert np.all(np.abs(found.baseline - best.x[:3]) < found.baseline_std / 5)
    assert found.parts[0].values[0] == pytest.approx(best.x[3], abs=found.parts[0].std[0] / 5)
    assert float(left @ left) == pytest.approx(2 * best.cost, rel=1e-4)
    assert found.parts[0].values[0] == pytest.approx(SIZE, abs=4 * found.parts[0].std[0])


def test_it_asks_for_the_effect_no_more_often_than_it_must(world: type[Any]) -> None:
    """Once for every step that is tried, once for every derivative; the same numbers are asked for again at the end."""
    calls: list[bytes] = []
    problems = [bent(world(seed=3).problem(part), calls) for part in (0, 1)]
    calls.clear()
    refitted(problems)
    steps = len(set(calls)) // 2
    assert 3 <= steps <= MOST_STEPS
    assert len(calls) <= 2 * (len(set(calls)) + 3)


def test_what_a_way_of_telling_adds_to_a_deviation_is_absolute_or_a_part(world: type[Any]) -> None:
    plain, wide, relative = (
        refitted([bent(world(seed=3).problem(part), [], **more) for part in (0, 1)])[0].parts[0]
        for more in ({}, {"spread": 0.1}, {"part": 0.25})
    )
    assert wide.std[0] == pytest.approx(np.hypot(plain.std[0], 0.1))
    assert relative.std[0] == pytest.approx(np.hypot(plain.std[0], 0.25 * plain.values[0]))


def test_a_number_above_zero_is_given_by_its_size(world: type[Any]) -> None:
    """The law of the second number is even in it; its fit begins on the other side of zero."""

    def even(problem: Problem) -> Problem:
        straight, curved = (problem.candidate(f"{name}@place").variants[0].columns for name in ("a", "b"))
        pairs = [(one, two) for one, two in zip(straight, curved, strict=True) if one is not None and two is not None]

        def form(values: Array, baseline: Array) -> list[Array | None]:
            return [values[0] * one[:, 0] + values[1] ** 2 * two[:, 0] for one, two in pairs]

        added = form(np.array([SIZE, CURVED]), TRUTH)
        blocks = [
            replace(b, target=b.target + (0.0 if a is None else a)) for b, a in zip(problem.blocks, added, strict=True)
        ]
        parameters = (EffectParameter("size", "Nm", ""), EffectParameter("speed", "m/s", "", positive=True))
        variant = Variant(straight, lambda found: np.array([found[0], -1.0]))
        first = Candidate("a", "place", parameters, (variant,), form)
        return replace(problem, blocks=tuple(blocks), candidates=(first, *problem.candidates[1:]))

    part = refitted([even(world(seed=3).problem(number)) for number in (0, 1)])[0].parts[0]
    assert part.values == pytest.approx([SIZE, CURVED], abs=0.1)


def test_what_was_found_is_taken_whole_where_the_fitted_rows_have_none_of_it(world: type[Any]) -> None:
    def found_in(problem: Problem, share: float) -> Problem:
        """Its series `a` is in its target, and found there, in one of the two records alone."""
        series = tuple(None if one is None else share * one for one in problem.candidates[0].variants[0].columns)
        blocks = [
            replace(b, target=b.target + (0.0 if a is None else a[:, 0]))
            for b, a in zip(problem.blocks, series, strict=True)
        ]
        first = replace(problem.candidates[0], variants=(Variant(series),), as_found=True)
        return replace(problem, blocks=tuple(blocks), candidates=(first, *problem.candidates[1:]))

    problems = [found_in(world(seed=3).problem(part), share) for part, share in ((0, 0.0), (1, 2.0))]
    regression = Regression(problems[0], make_rows(*problems))
    fitted = ~regression.rows.confirming
    found = refit(problems, regression, (0,), whitener_of(regression), fitted)
    assert found.parts[0].values == pytest.approx([1.0])
    for (block, _), model in list(zip(regression.rows.blocks, found.blocks, strict=True))[2:]:
        assert np.std(block.target - model) < 0.7 * np.std(block.target - block.baseline @ TRUTH)

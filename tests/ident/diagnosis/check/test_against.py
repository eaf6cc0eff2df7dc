"""How much less likely a member makes rows that it was not fitted to, in deviations."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ident.diagnosis.check.against import deviations_against
from ident.diagnosis.check.fitted import Fitted, Taken
from ident.diagnosis.noise.colours import Noise
from ident.diagnosis.problem import Problem, Variant

Asked = Callable[[Problem, Problem], Any]

SIZE = 0.4


def variants_of(name: str, question: Any) -> tuple[int, ...]:
    """Numbers of the variants of an effect."""
    candidates = question.regression.problem.candidates
    return tuple(n for n, one in enumerate(question.regression.rows.layout) if candidates[one.candidate].effect == name)


def against(world: Callable[..., Any], asked: Asked, seed: int, changed: Callable[[Problem], Problem]) -> float:
    """Of `b`, which is nothing anywhere, its candidate changed in the fitted rows."""
    made = world(seed, samples=120)
    problems = [changed(made.problem(0)), made.problem(1)]
    question = asked(*problems)
    fitted = Fitted(
        problems,
        question.regression,
        Taken(variants_of("b", question), Noise(question.colours, question.colours.usual)),
        1,
    )
    return deviations_against(fitted)[0]


def against_and_power(world: Callable[..., Any], asked: Asked, seed: int, confirmed: float) -> tuple[float, float]:
    """Of `b`, whose size is SIZE in the fitted rows; and the power of what it adds to the confirming ones, white."""
    problems = [world(seed, samples=120, true={"b": size}).problem(part) for part, size in enumerate((SIZE, confirmed))]
    question = asked(*problems)
    rows, noise = question.regression.rows, Noise(question.colours, question.colours.usual)
    (variant,) = [
        number for number, one in enumerate(rows.layout) if problems[0].candidates[one.candidate].effect == "b"
    ]
    fitted = Fitted(problems, question.regression, Taken((variant,), noise), seed=1)
    added = SIZE * question.regression.columns_of([variant])
    white = noise.apply(rows, np.column_stack([added, rows.baseline]))[rows.confirming]
    return deviations_against(fitted)[0], float(np.sum(white[:, 0] ** 2))


@pytest.mark.parametrize("there", [True, False])
def test_it_is_half_the_root_of_the_power_of_what_is_added_give_or_take_one(
    world: Callable[..., Any], asked: Asked, there: bool
) -> None:
    """Below where it is there and above where it is not; of as many fitted rows its size is as open as they are noisy.

    The parameters, fitted anew without it, take a part of it.
    """
    made = [against_and_power(world, asked, seed, SIZE if there else 0.0) for seed in range(40)]
    found, power = np.array(made).T
    expected = (-1.0 if there else 1.0) * np.sqrt(power) / 2 / math.sqrt(2)
    assert abs(np.mean(expected)) > 2
    assert np.mean(found) == pytest.approx(np.mean(expected), rel=0.3)
    assert 0.7 < np.std(found - expected) < 1.3


def test_what_the_fitted_rows_leave_open_counts(world: Callable[..., Any], asked: Asked) -> None:
    """A column that is a parameter's but for a thirtieth: its size is hardly told, and contradicts nothing."""

    def hardly_told(problem: Problem) -> Problem:
        b = problem.candidates[1]
        columns = tuple(
            block.baseline[:, :1] + column / 30
            for block, column in zip(problem.blocks, b.variants[0].columns, strict=True)
            if column is not None
        )
        others = [replace(one, variants=(Variant(columns),)) if one is b else one for one in problem.candidates]
        return replace(problem, candidates=tuple(others))

    made = [against(world, asked, seed, hardly_told) for seed in range(10)]
    assert max(made) < 3.5


def test_what_nothing_is_told_of_speaks_neither_for_nor_against(world: Callable[..., Any], asked: Asked) -> None:
    """An effect that is there, large, and told in every other stretch of the confirming rows: it is not refuted.

    Where it is told and where it is not, what is left differs by what it adds: an edge that noise does not have.
    """
    for seed in range(10):
        made = world(seed, samples=120, true={"b": 20 * SIZE})
        problems = [made.problem(0), made.problem(1)]
        question = asked(*problems)
        blocks = [block for block, _ in question.regression.rows.blocks]
        told = tuple(np.arange(len(block.target)) // 10 % 2 == 0 for block in blocks)
        found = Taken(variants_of("b", question), Noise(question.colours, question.colours.usual))
        whole, nothing, partly = (
            deviations_against(Fitted(problems, question.regression, found, 1, masks))[0]
            for masks in ((), tuple(np.zeros_like(one) for one in told), told)
        )
        assert nothing == 0.0
        assert whole < partly < 0

"""How much less likely a member makes rows that it was not fitted to, in deviations."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from ident.diagnosis.check.fitted import Fitted, Taken
from ident.diagnosis.noise.colours import Noise
from ident.diagnosis.problem import Problem

Asked = Callable[[Problem, Problem], Any]

SIZE = 0.4


def widening_and_power(world: Callable[..., Any], asked: Asked, seed: int, confirmed: float) -> tuple[float, float]:
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
    return fitted.widening(0), float(np.sum(white[:, 0] ** 2))


@pytest.mark.parametrize("there", [True, False])
def test_it_is_half_the_root_of_the_power_of_what_is_added_give_or_take_one(
    world: Callable[..., Any], asked: Asked, there: bool
) -> None:
    """Below where it is there and above where it is not; the parameters, fitted anew without it, take a part of it."""
    made = [widening_and_power(world, asked, seed, SIZE if there else 0.0) for seed in range(40)]
    found, power = np.array(made).T
    expected = (-1.0 if there else 1.0) * np.sqrt(power) / 2
    assert abs(np.mean(expected)) > 3
    assert np.mean(found) == pytest.approx(np.mean(expected), rel=0.2)
    assert 0.7 < np.std(found - expected) < 1.6

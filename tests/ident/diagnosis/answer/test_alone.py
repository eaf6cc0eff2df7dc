"""What a name closes in place of the answer: all of it if it is the true one, nothing if it has no part in it."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ident.diagnosis.answer.alone import Alone, closed_alone
from ident.diagnosis.answer.judge import judge
from ident.diagnosis.problem import Nominal, Problem

TRUE = np.array([1.0, -2.0, 0.5])


def _alone(problems: tuple[Problem, Problem], *keys: str) -> dict[str, Alone]:
    free = [replace(problem, nominal=None) for problem in problems]
    return {one.name: one for one in closed_alone(judge(*free, seed=1), problems, keys)}


def _problems(world: Any, values: Any = TRUE) -> tuple[Problem, Problem]:
    nominal = Nominal(np.asarray(values, dtype=float), np.full(3, 0.01))
    first, second = (replace(world.problem(part), nominal=nominal) for part in (0, 1))
    return first, second


def test_the_true_name_closes_the_gap_and_no_other_does(world: type[Any]) -> None:
    found = _alone(_problems(world(seed=7, true={"c": 0.4})))
    assert set(found) == {"a", "b", "c", "d", "e", "f"}
    assert min(found["c"].refitted, found["c"].held) > 0.9
    others = [one for name, one in found.items() if name != "c"]
    assert all(abs(closed) < 0.2 for one in others for closed in (one.refitted, one.held))


def test_it_is_one_minus_what_is_left_above_the_floor(world: type[Any]) -> None:
    """The share by hand: rms of the confirming rows, parameters at their true values, noise of variance one."""
    problems = _problems(world(seed=7, true={"c": 0.4}))
    (index,) = [n for n, candidate in enumerate(problems[0].candidates) if candidate.effect == "c"]
    fitted, confirming = (
        [
            (block.target - block.baseline @ TRUE, column[:, 0])
            for block, column in zip(problem.blocks, problem.candidates[index].variants[0].columns, strict=True)
            if column is not None
        ]
        for problem in problems
    )
    residual, column = (np.concatenate(parts) for parts in zip(*fitted, strict=True))
    size = residual @ column / (column @ column)
    residual, column = (np.concatenate(parts) for parts in zip(*confirming, strict=True))
    before, after = np.mean(residual**2), np.mean((residual - size * column) ** 2)
    assert _alone(problems)["c"].held == pytest.approx(1 - (after - 1) / (before - 1), abs=0.15)


def test_what_the_parameters_explain_counts_only_where_they_are_held(world: type[Any]) -> None:
    """The model's p is off by 0.5: another column is of no use, and a refit of them leaves no gap to close."""
    found = _alone(_problems(world(seed=7), TRUE + np.array([0.5, 0.0, 0.0])))
    assert all(abs(one.held) < 0.2 for one in found.values())


def test_a_changed_parameter_closes_nothing_where_parameters_are_refitted(world: type[Any]) -> None:
    problems = _problems(world(seed=7), TRUE + np.array([0.5, 0.0, 0.0]))
    drifted = tuple(_with_drift(problem) for problem in problems)
    one = _alone((drifted[0], drifted[1]))["changed_p"]
    assert math.isnan(one.refitted)
    assert one.held > 0.9


def test_without_a_model_no_parameters_are_held(world: type[Any]) -> None:
    built = world(seed=7, true={"c": 0.4})
    found = _alone((built.problem(0), built.problem(1)))
    assert all(math.isnan(one.held) for one in found.values())
    assert found["c"].refitted > 0.9


def test_a_size_of_the_wrong_sign_closes_nothing(world: type[Any]) -> None:
    problems = tuple(
        replace(problem, candidates=tuple(replace(one, least=0.0) for one in problem.candidates))
        for problem in _problems(world(seed=7, true={"c": -0.4}))
    )
    assert _alone((problems[0], problems[1]))["c"].refitted == 0.0


def test_of_all_places_of_a_name_the_best_counts_unless_one_is_given(world: type[Any]) -> None:
    """`d` is renamed to a second place of `c`."""

    def placed(problem: Problem) -> Problem:
        renamed = tuple(
            replace(one, effect="c", where="elsewhere") if one.effect == "d" else one for one in problem.candidates
        )
        return replace(problem, candidates=renamed)

    problems = _problems(world(seed=7, true={"c": 0.4}))
    both = placed(problems[0]), placed(problems[1])
    assert _alone(both)["c"].where == "place"
    given = _alone(both, "c@elsewhere")["c"]
    assert given.where == "elsewhere"
    assert abs(given.refitted) < 0.2


def _with_drift(problem: Problem) -> Problem:
    first = problem.candidates[0]
    columns = tuple(block.baseline[:, :1] for block in problem.blocks)
    changed = replace(first, effect="changed_p", variants=(replace(first.variants[0], columns=columns),), drift=True)
    return replace(problem, candidates=(*problem.candidates, changed))

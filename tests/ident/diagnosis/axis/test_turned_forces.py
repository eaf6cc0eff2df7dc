"""An effect that turns the forces of others: an effort is late with everything in it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from hil.exam.sources.machine import Machine
from ident.diagnosis.answer.judge import judge
from ident.diagnosis.axis.problem import axis_problem
from ident.diagnosis.axis.reference import axis_reference
from ident.diagnosis.check.refit import Refit, refit
from ident.diagnosis.observations.regression import Regression
from ident.diagnosis.observations.rows import make_rows
from ident.diagnosis.problem import Candidate, Problem, Series, forces_of, turned_by

Array = NDArray[np.float64]

TURNING, TURNED = 0.5, 0.3


def scaled(series: Series, size: float) -> list[Array | None]:
    return [None if one is None else size * one for one in series]


def columns_of(candidate: Candidate) -> list[Array | None]:
    """Of the only column of its first variant."""
    return [None if one is None else one[:, 0] for one in candidate.variants[0].columns]


def with_gain(problem: Problem) -> Problem:
    """`a` adds its column and makes all forces as much greater; `c` has a force. Both are in the target."""
    a, c = (problem.candidate(f"{name}@place") for name in ("a", "c"))
    own, force = columns_of(a), columns_of(c)
    a = replace(
        a,
        contribution=lambda values, _: scaled(own, float(values[0])),
        turned=lambda values, forces: scaled(forces, float(values[0])),
    )
    c = replace(c, force=lambda values, _: scaled(force, float(values[0])))
    blocks = tuple(
        replace(block, target=block.target + TURNING * one + (1 + TURNING) * TURNED * other)
        for block, one, other in zip(problem.blocks, own, force, strict=True)
        if one is not None and other is not None
    )
    changed = {"a": a, "c": c}
    candidates = tuple(changed.get(one.effect, one) for one in problem.candidates)
    return replace(problem, blocks=blocks, candidates=candidates)


@pytest.fixture
def problems(world: type[Any]) -> tuple[Problem, Problem]:
    drawn = world(seed=17, samples=1600)
    return with_gain(drawn.problem(0)), with_gain(drawn.problem(1))


def refitted(problems: Sequence[Problem]) -> Refit:
    regression = Regression(problems[0], make_rows(*problems))
    keys = [problems[0].candidates[column.candidate].key for column in regression.rows.layout]
    variants = [keys.index(key) for key in ("a@place", "c@place")]
    everything = np.ones(len(regression.rows), dtype=bool)
    whitener = regression.colour_beside(regression.columns_of(variants))
    return refit(problems, regression, variants, whitener, everything)


def test_sizes_beside_what_turns_them_are_their_own(problems: tuple[Problem, Problem]) -> None:
    for part, true in zip(refitted(problems).parts, (TURNING, TURNED), strict=True):
        assert part.values[0] == pytest.approx(true, abs=3 * part.std[0])
        assert part.std[0] < 0.02


def test_without_being_turned_a_size_is_what_became_of_it(problems: tuple[Problem, Problem]) -> None:
    adding = [
        replace(problem, candidates=tuple(replace(one, turned=None) for one in problem.candidates))
        for problem in problems
    ]
    _, part = refitted(adding).parts
    assert part.values[0] == pytest.approx((1 + TURNING) * TURNED, abs=3 * part.std[0])


def test_the_posterior_finds_both_with_their_sizes(problems: tuple[Problem, Problem]) -> None:
    found = {str(cause.candidate.effect): cause.part for cause in judge(*problems, seed=1).causes}
    assert set(found) == {"a", "c"}
    for name, true in (("a", TURNING), ("c", TURNED)):
        assert found[name].values[0] == pytest.approx(true, abs=3 * found[name].std[0])


def test_an_axis_that_is_late_makes_nothing_of_a_force_on_another() -> None:
    """Of two axes the first is late, the second has a drag."""
    record = Machine(follower=(15.0, 3.0), repeats=1, duration=8.0).drive(5)
    reference = axis_reference([record])
    punctual = replace(reference, scales=tuple(replace(scale, delayed=True) for scale in reference.scales))
    problem = axis_problem([record], punctual)
    first, second = (axis.named("axis") for axis in record.axes)
    drag, late = problem.candidate(f"quadratic_drag@{second}"), problem.candidate(f"time_delay@{first}")
    forces = forces_of([drag], np.array([1.0]), np.zeros(0))
    assert [force is None for force in forces] == [True, False]
    assert turned_by([late], np.array([0.002]), forces) == [None, None]


def test_forces_and_what_is_made_of_them_follow_the_blocks_of_both_problems(
    problems: tuple[Problem, Problem],
) -> None:
    late, ripple = ([problem.candidate(key) for problem in problems] for key in ("a@place", "c@place"))
    forces = forces_of(ripple, np.array([2.0]), np.zeros(3))
    turned = turned_by(late, np.array([3.0]), forces)
    assert len(forces) == len(turned) == sum(len(problem.blocks) for problem in problems)
    for force, one in zip(forces, turned, strict=True):
        assert force is not None
        assert one is not None
        np.testing.assert_allclose(one, 3.0 * force)

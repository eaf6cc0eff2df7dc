"""What a named effect leaves: little is pardoned, much is not; rows of which the model says nothing tell it all."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.diagnosis.diagnosis import Verdict
from ident.diagnosis.judge import judge
from ident.diagnosis.problem import Block, Problem

Array = NDArray[np.float64]


def two(world: type[Any], seed: int, true: dict[str, float]) -> tuple[Problem, Problem]:
    drawn = world(seed=seed, true=true)
    return drawn.problem(0), drawn.problem(1)


def changed(problem: Problem, change: Callable[[Block], Block]) -> Problem:
    """The problem with its coordinate y changed."""
    return replace(problem, blocks=tuple(change(one) if one.coordinate == "y" else one for one in problem.blocks))


def repeated(block: Block, seed: int) -> Array:
    """A motion of the same length that no candidate has, the same in every repeat."""
    length = int(np.sum(block.period == 0))
    smooth = np.convolve(np.random.default_rng(seed).normal(size=length + 20), np.ones(21), mode="valid")
    return np.tile(smooth / smooth.std(), len(block.target) // length)


@pytest.mark.parametrize(("size", "verdict"), [(0.45, Verdict.EFFECT), (0.75, Verdict.UNKNOWN), (1.4, Verdict.UNKNOWN)])
def test_what_lasts_above_the_noise_takes_an_effect_that_closes_nearly_all(
    world: type[Any], size: float, verdict: Verdict
) -> None:
    """Of a power of 2 * 2² the remainder is a fortieth, a fifteenth or a fifth."""
    problems = [
        changed(problem, lambda block: replace(block, target=block.target + size * repeated(block, 5)))
        for problem in two(world, 21, {"a": 2.0})
    ]
    findings = judge(*problems, seed=1)
    assert findings.verdict is verdict
    assert findings.causes[0].candidate.effect == "a"


def only_a_cause(problem: Problem, misfit: float) -> Problem:
    """Coordinate y says nothing of the model, all of it is `a`, a part of it of another shape than its column."""
    column = problem.candidate("a@place").variants[0].columns[1]
    assert column is not None

    def change(block: Block) -> Block:
        noise = 0.05 * np.random.default_rng(8).normal(size=len(block.target))
        shape = column[:, 0] + misfit * repeated(block, 6)
        return replace(block, baseline=np.zeros_like(block.baseline), target=shape + noise, tolerance=0.05)

    return changed(problem, change)


@pytest.mark.parametrize(("misfit", "verdict"), [(0.0, Verdict.EFFECT), (0.2, Verdict.UNKNOWN)])
def test_rows_of_which_the_model_says_nothing_must_be_explained_to_their_tolerance(
    world: type[Any], misfit: float, verdict: Verdict
) -> None:
    """A cause that closes 96 % there, where 99.7 % are told, is not the cause."""
    problems: Sequence[Problem] = [only_a_cause(problem, misfit) for problem in two(world, 22, {"a": 1.0})]
    findings = judge(*problems, seed=1)
    assert findings.causes[0].candidate.effect == "a"
    assert findings.causes[0].closed > 0.9
    assert findings.verdict is verdict

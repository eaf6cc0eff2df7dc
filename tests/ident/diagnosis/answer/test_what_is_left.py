"""What a named effect leaves: it is said, and much of it takes the name."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.diagnosis.answer.judge import judge
from ident.diagnosis.diagnosis import Verdict
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


@pytest.mark.parametrize(
    ("size", "verdict", "lasting"),
    [(0.45, Verdict.EFFECT, False), (1.4, Verdict.EFFECT, True), (3.5, Verdict.UNKNOWN, True)],
)
def test_what_lasts_above_the_noise_is_said_and_takes_an_effect_that_closes_less_than_half(
    world: type[Any], size: float, verdict: Verdict, lasting: bool
) -> None:
    """Of a power of 2 * 2² the remainder is a fortieth, a fifth, or half as much again."""
    problems = [
        changed(problem, lambda block: replace(block, target=block.target + size * repeated(block, 5)))
        for problem in two(world, 21, {"a": 2.0})
    ]
    findings = judge(*problems, seed=1)
    assert (findings.verdict, findings.lacking) == (verdict, lasting)
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


@pytest.mark.parametrize("misfit", [0.0, 0.2])
def test_what_lasts_in_rows_of_which_the_model_says_nothing_is_said_beside_the_cause(
    world: type[Any], misfit: float
) -> None:
    """It closes 96 % there, where 99.7 % are told."""
    problems: Sequence[Problem] = [only_a_cause(problem, misfit) for problem in two(world, 22, {"a": 1.0})]
    findings = judge(*problems, seed=1)
    assert findings.causes[0].candidate.effect == "a"
    assert findings.causes[0].closed > 0.9
    assert findings.verdict is Verdict.EFFECT
    assert findings.lacking == (misfit > 0)


@pytest.mark.parametrize(
    ("size", "hidden", "believed", "names"),
    [(2.0, 0.0, 0.97, ("b",)), (6.0, 1.8, 0.97, ("b",)), (2.0, 1.8, 0.5, ("b", "law"))],
)
def test_a_name_beside_which_much_of_the_gap_is_left_is_believed_half(
    world: Callable[..., Any], size: float, hidden: float, believed: float, names: tuple[str, ...]
) -> None:
    """What the library lacks is beside it or in its place; of a large gap a little is left by what is right."""
    made = world(7, true={"b": size}, hidden=hidden)
    findings = judge(made.problem(0), made.problem(1), seed=1)
    first, *others = findings.diagnosis().effects
    assert (first.name, others) == ("b", [])
    assert first.probability == pytest.approx(believed, abs=0.01)
    assert first.ambiguity_set == names


def test_what_makes_quiet_held_out_rows_worse_is_no_answer(world: Callable[..., Any]) -> None:
    """What the fitted record has, and the confirming one has not: of that all is noise, and less of it."""
    confirm, truth = world(32, repeats=1, samples=3200).problem(1), np.array([1.0, -2.0, 0.5])
    quiet = replace(
        confirm,
        blocks=tuple(
            replace(block, target=0.4 * block.target + 0.6 * block.baseline @ truth) for block in confirm.blocks
        ),
    )
    findings = judge(world(32, repeats=1, samples=3200, true={"c": 0.2}).problem(0), quiet, seed=1)
    assert findings.gap.before < findings.gap.floor
    assert findings.gap.after**2 > 1.1 * findings.gap.before**2
    assert findings.verdict is Verdict.UNKNOWN

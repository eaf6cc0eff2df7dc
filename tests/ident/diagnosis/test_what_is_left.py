"""What a named effect leaves: little is pardoned, much is not; rows of which the model says nothing tell it all."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.diagnosis.diagnosis import Verdict
from ident.diagnosis.judge import judge
from ident.diagnosis.judgement import Judgement
from ident.diagnosis.law.dependence import Dependence, Partner, Variable
from ident.diagnosis.limits import Limits
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


def _dependence(variable: Variable, partner: Partner) -> Dependence:
    return Dependence("axis", variable, partner, "rad", "Nm", (), lambda _basis: ())


@pytest.mark.parametrize(
    ("variable", "partner", "causes", "measurable", "least"),
    [
        (Variable.RATE, Partner.NOTHING, 1, False, -math.inf),
        (Variable.ANGLE, Partner.DIRECTION, 1, False, -math.inf),
        (Variable.RATE, Partner.NOTHING, 2, False, 0.0),
        (Variable.LOAD_SECOND_RATE, Partner.NOTHING, 1, False, 0.0),
        (Variable.ANGLE, Partner.ACCELERATION, 1, False, 0.0),
        (Variable.RATE, Partner.NOTHING, 1, True, Limits().law),
    ],
)
def test_a_law_that_is_all_of_the_answer_need_not_close_a_gap_within_its_noise_unless_that_noise_is_in_it(
    variable: Variable, partner: Partner, causes: int, measurable: bool, least: float
) -> None:
    law = SimpleNamespace(dependence=_dependence(variable, partner))
    judgement = SimpleNamespace(
        fitted=SimpleNamespace(count=causes),
        limits=Limits(),
        _law=lambda _index: law,
        _measurable=lambda: measurable,
    )
    assert Judgement._least(cast("Judgement", judgement), 0) == least


@pytest.mark.parametrize(("held", "gained", "pays"), [(0.02, 0.0, True), (0.004, 0.0, False), (0.004, 0.06, True)])
def test_an_effect_beside_others_counts_by_the_share_that_is_written_of_it_or_by_what_it_gains(
    held: float, gained: float, pays: bool
) -> None:
    """Not by what it would close with everything refitted: that share is told nowhere."""
    fitted = SimpleNamespace(lacking=[held], gain=lambda _index, _blur: gained)
    judgement = SimpleNamespace(fitted=fitted, limits=Limits())
    assert Judgement._pays(cast("Judgement", judgement), 0) is pays

"""What repeats is in no colour, and a large effect has no companion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import signal

from ident.diagnosis.answer.judge import judge
from ident.diagnosis.observations.regression import Regression
from ident.diagnosis.observations.rows import Rows, make_rows
from ident.diagnosis.observations.whitening import TAPER, Whitener, colours_of_repeats, fit_whitener, predictor_of
from ident.diagnosis.problem import Block, Candidate, Problem, Variant
from ident.effects import EffectParameter

Array = NDArray[np.float64]

TRUTH = np.array([1.0, -2.0, 0.5])


def residuals(problem: Problem) -> list[Array]:
    return [block.target - block.baseline @ TRUTH for block in problem.blocks]


def test_an_effect_that_repeats_does_not_change_the_colour_of_the_noise(world: type[Any]) -> None:
    plain, large = (world(seed=3, true=true).problem(0) for true in ({}, {"a": 5.0}))
    colours = [colours_of_repeats(make_rows(one), residuals(one)) for one in (plain, large)]
    for first, second in zip(*colours, strict=True):
        assert second.covariance == pytest.approx(first.covariance, abs=1e-12)


def test_the_colour_of_repeats_is_that_of_their_mean(world: type[Any]) -> None:
    """Four repeats of noise of unit variance: the mean has a quarter of it."""
    problem = world(seed=4, samples=4000).problem(0)
    for colour in colours_of_repeats(make_rows(problem), residuals(problem)):
        assert colour.covariance[0] == pytest.approx(0.25, rel=0.1)


@pytest.mark.parametrize("poles", [0.0, 0.5, 0.9, 0.95])
@pytest.mark.parametrize("repeats", [2, 4])
def test_means_of_short_repeats_are_white_by_what_differs_between_them(
    world: type[Any], repeats: int, poles: float
) -> None:
    """Some eighty rows of what falls off by up to four orders: through their window it would be flat."""
    problem, squares = world(seed=4, samples=400, repeats=repeats).problem(0), []
    rows = make_rows(problem)
    for seed in range(30):
        made = _of_two_poles(problem, rows, seed, poles)
        whitener = Whitener(tuple(predictor_of(one) for one in colours_of_repeats(rows, made)))
        squares.append(np.mean(whitener.apply(rows, rows.stack(made)) ** 2))
    spectrum = np.abs(1 - poles * np.exp(1j * np.linspace(0, np.pi, 2000))) ** -4
    # No band may be below a white share of the variance, of which the fast part of the steepest has less.
    assert np.mean(squares) == pytest.approx(np.mean(spectrum / (spectrum + TAPER * spectrum.mean())), abs=0.12)


def _of_two_poles(problem: Problem, rows: Rows, seed: int, poles: float) -> list[Array]:
    """Residuals whose rows are an autoregression with innovations of unit variance, another one in every repeat."""
    generator, found = np.random.default_rng(seed), []
    for block, (_, kept) in zip(problem.blocks, rows.blocks, strict=True):
        drawn = generator.normal(size=(len(kept.samples), 500 + kept.samples.shape[1]))
        residual = np.zeros(len(block.target))
        residual[kept.samples] = signal.lfilter([1.0], np.poly([poles, poles]), drawn)[:, 500:]
        found.append(residual)
    return found


def test_without_repeats_the_colour_is_that_of_what_is_left(world: type[Any]) -> None:
    problem = world(seed=5, repeats=1, samples=3200).problem(0)
    rows, left = make_rows(problem), residuals(problem)
    colours = colours_of_repeats(rows, left)
    assert all(colour.count == 0 for colour in colours)
    stacked = rows.stack(left)
    with_them, without = fit_whitener(rows, stacked, repeats=colours), fit_whitener(rows, stacked)
    assert np.array_equal(with_them.apply(rows, stacked), without.apply(rows, stacked))


def test_where_model_errors_prevail_the_colour_is_theirs(world: type[Any]) -> None:
    problem = world(seed=6, true={"a": 3.0}).problem(0)
    rows, left = make_rows(problem), residuals(problem)
    stacked = rows.stack(left)
    white = fit_whitener(rows, stacked, repeats=colours_of_repeats(rows, left)).apply(rows, stacked)
    assert float(np.mean(white**2)) == pytest.approx(1.0, abs=0.1)


def test_what_is_known_not_to_repeat_is_no_noise(world: type[Any]) -> None:
    """Sliding comes and goes from repeat to repeat; found in each of them, it is taken off before noise is measured."""
    calm = [world(seed=11).problem(part) for part in (0, 1)]
    generator = np.random.default_rng(12)
    slid = [[5.0 * generator.normal(size=len(block.target)) for block in problem.blocks] for problem in calm]

    def noise(known: bool) -> Array:
        problems = [
            replace(
                problem,
                blocks=tuple(
                    replace(block, target=block.target + extra, irregular=extra if known else None)
                    for block, extra in zip(problem.blocks, series, strict=True)
                ),
            )
            for problem, series in zip(calm, slid, strict=True)
        ]
        return power(problems)

    def power(problems: Sequence[Problem]) -> Array:
        regression = Regression(problems[0], make_rows(*problems))
        return np.array([colour.covariance[0] for colour in regression.repeats])

    assert noise(known=True) == pytest.approx(power(calm), rel=0.02)
    assert np.all(noise(known=False) > 4 * power(calm))


def bent(problem: Problem, size: float, name: str = "a", by: str = "b") -> Problem:
    """A world whose effect is half a square beside its column: s a + s² b/2, b being the column of another effect."""
    straight, curved = (problem.candidate(f"{one}@place").variants[0].columns for one in (name, by))

    def contribution(values: Array, _: Array) -> list[Array | None]:
        s = float(values[0])
        return [s * one[:, 0] + s**2 / 2 * two[:, 0] for one, two in pairs]

    pairs = [(one, two) for one, two in zip(straight, curved, strict=True) if one is not None and two is not None]
    truth = contribution(np.array([size]), np.zeros(3))
    blocks: list[Block] = [
        replace(block, target=block.target + (0.0 if added is None else added))
        for block, added in zip(problem.blocks, truth, strict=True)
    ]
    one = Candidate(name, "place", (EffectParameter("size", "Nm", ""),), (Variant(straight),), contribution)
    candidates = tuple(one if each.effect == name else each for each in problem.candidates)
    return replace(problem, blocks=tuple(blocks), candidates=candidates)


@pytest.mark.parametrize("size", [0.6, 1.5])
def test_what_the_column_of_a_large_effect_misses_is_no_second_effect(world: type[Any], size: float) -> None:
    findings = judge(*(bent(world(seed=8).problem(part), size) for part in (0, 1)), seed=1)
    assert [cause.candidate.effect for cause in findings.causes] == ["a"]
    assert findings.causes[0].part.values[0] == pytest.approx(size, abs=0.03)


def test_of_two_effects_of_one_column_the_shape_tells(world: type[Any]) -> None:
    """Near zero `a` and `c` are the same; only at its size does a rival show what it is."""
    alike = world(seed=8, alike={"c": "a"})
    problems = [bent(bent(alike.problem(part), 0.0, "a", "d"), 1.5, "c", "b") for part in (0, 1)]
    findings = judge(*problems, seed=1)
    assert [cause.candidate.effect for cause in findings.causes] == ["c"]
    assert findings.causes[0].part.values[0] == pytest.approx(1.5, abs=0.03)

"""Rows, whitening, likelihood ratios: against formulas written another way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.diagnosis.observations.directions import White, directions
from ident.diagnosis.observations.rows import Column, kept_rows, make_rows
from ident.diagnosis.observations.whitening import fit_whitener
from ident.diagnosis.problem import Candidate, Problem, Variant

Array = NDArray[np.float64]


def test_rows_are_means_over_the_repeats_and_leave_stiction_out(world: type[Any]) -> None:
    block = world(seed=1).problem(0).blocks[0]
    moving = block.moving.copy()
    moving[100:130] = False
    kept = kept_rows(replace(block, moving=moving))
    folded = block.target.reshape(4, -1)
    assert kept.samples.shape[0] == 4
    np.testing.assert_allclose(kept.mean(block.target), folded.mean(axis=0)[kept.samples[0]])
    assert not np.any((kept.samples[0] >= 100) & (kept.samples[0] < 130))
    assert np.unique(kept.runs).size == 2


def test_rows_are_as_dense_as_the_bandwidth_needs(world: type[Any]) -> None:
    block = world(seed=1).problem(0).blocks[0]
    slow = kept_rows(replace(block, bandwidth=5.0))
    assert slow.rate == pytest.approx(3 * 5.0 / (2 * np.pi), rel=0.1)
    assert kept_rows(block).rate > slow.rate


def test_a_block_without_repeats_keeps_all_its_samples_in_time(world: type[Any]) -> None:
    block = world(seed=1).problem(0).blocks[0]
    kept = kept_rows(replace(block, period=np.full(len(block.target), -1)))
    assert kept.samples.shape[0] == 1
    assert np.all(np.diff(kept.samples[0]) == kept.samples[0][1] - kept.samples[0][0])


def test_problems_that_do_not_belong_together_are_refused(world: type[Any]) -> None:
    fit = world(seed=1).problem(0)
    with pytest.raises(ValueError, match="differ"):
        make_rows(fit, replace(fit, candidates=fit.candidates[:-1]))


def test_whitened_noise_is_white_and_of_unit_size(world: type[Any]) -> None:
    rows = make_rows(world(seed=3, samples=4000).problem(0))
    noise = rows.target - rows.baseline @ np.linalg.lstsq(rows.baseline, rows.target, rcond=None)[0]
    white = fit_whitener(rows, noise, 3).apply(rows, noise)
    raw = [float(noise[lag:] @ noise[:-lag] / (noise @ noise)) for lag in (1, 2, 5)]
    left = [float(white[lag:] @ white[:-lag] / (white @ white)) for lag in (1, 2, 5)]
    assert max(raw) > 0.4
    assert np.max(np.abs(left)) < 4 / np.sqrt(len(rows))
    assert np.std(white) == pytest.approx(1.0, abs=0.03)


def test_few_rows_without_repeats_are_as_far_below_their_noise_as_others_are_above_it(world: type[Any]) -> None:
    """An autoregression of order d leaves 1 - d/n of n rows that it is fitted to, and 1 + d/n of others (Akaike)."""
    rows = make_rows(world(seed=3).problem(0))
    own, others = [], []
    for seed in range(40):
        noise, fresh = np.random.default_rng([4, seed]).normal(size=(2, len(rows)))
        whitener = fit_whitener(rows, noise)
        own.append(np.mean(whitener.apply(rows, noise) ** 2))
        others.append(np.mean(whitener.apply(rows, fresh) ** 2))
    assert np.mean(own) < 0.98
    assert np.mean([*own, *others]) == pytest.approx(1.0, abs=0.01)


def test_whitening_restarts_at_every_interruption(world: type[Any]) -> None:
    """What stands before a gap in the rows does not reach behind it."""
    problem = world(seed=3).problem(0)
    holes = tuple(replace(block, moving=np.arange(len(block.moving)) % 200 > 40) for block in problem.blocks)
    rows = make_rows(replace(problem, blocks=holes))
    whitener = fit_whitener(rows, rows.target)
    start = int(np.flatnonzero(np.diff(rows.run))[2]) + 1
    changed = rows.target.copy()
    changed[:start] += 100.0
    np.testing.assert_allclose(
        whitener.apply(rows, changed)[start:], whitener.apply(rows, rows.target)[start:], atol=1e-9
    )


def _white(seed: int, size: float) -> tuple[White, tuple[Column, ...]]:
    generator = np.random.default_rng(seed)
    baseline, columns = generator.normal(size=(600, 3)), generator.normal(size=(600, 4))
    columns[:, 3] = baseline @ np.array([1.0, 2.0, -1.0])
    target = baseline @ np.ones(3) + size * columns[:, 0] + generator.normal(size=600)
    layout = tuple(Column(index, 0, slice(index, index + 1), -np.inf, (0.0, 0.0)) for index in range(4))
    return White(target, baseline, columns, np.arange(600) >= 300), layout


def _ratios(white: White, layout: Sequence[Column]) -> Array:
    found = directions(white, layout)
    return found.ratios(found.basis.T @ found.residual)


def test_the_likelihood_ratio_is_what_least_squares_with_and_without_a_column_gives() -> None:
    white, layout = _white(1, 0.2)
    bare = np.linalg.lstsq(white.baseline, white.target, rcond=None)[1][0]
    for index, ratio in enumerate(_ratios(white, layout)[:3]):
        design = np.column_stack([white.baseline, white.columns[:, index]])
        assert ratio == pytest.approx(bare - np.linalg.lstsq(design, white.target, rcond=None)[1][0])


def test_what_the_baseline_absorbs_has_no_direction() -> None:
    white, layout = _white(2, 0.0)
    assert directions(white, layout).sizes.tolist() == [1, 1, 1, 0]
    assert _ratios(white, layout)[3] == 0


def test_a_coefficient_of_the_wrong_sign_counts_nothing() -> None:
    white, layout = _white(4, -0.4)
    bounded = (replace(layout[0], least=0.0), *layout[1:])
    assert _ratios(white, layout)[0] > 40
    assert _ratios(white, bounded)[0] == 0


def test_a_candidate_that_acts_nowhere_is_harmless(world: type[Any]) -> None:
    problem: Problem = world(seed=5).problem(0)
    nothing = Candidate("absent", "place", problem.candidates[0].parameters, (Variant((None, None)),))
    rows = make_rows(replace(problem, candidates=(*problem.candidates, nothing)))
    assert rows.layout[-1].place.stop == rows.layout[-1].place.start

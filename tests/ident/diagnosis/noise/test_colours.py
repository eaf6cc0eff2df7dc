"""What a model may have wrong, as the covariance of the rows has it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.diagnosis.noise.colours import SIZES, Colours
from ident.diagnosis.problem import Problem

Array = NDArray[np.float64]
Asked = Callable[[Problem, Problem], Any]

TOLERANCE = 2.0


def problems(world: Callable[..., Any], shape: Callable[[Array], Array] | None) -> tuple[Problem, Problem]:
    """Worlds in which something is tolerated; all along, or as `shape` says over the share of a repeat."""

    def tolerating(problem: Problem) -> Problem:
        blocks = []
        for block in problem.blocks:
            count = np.bincount(block.period)[0]
            share = np.arange(len(block.target)) % count / count
            tolerated = None if shape is None else shape(share)
            blocks.append(replace(block, tolerance=TOLERANCE, tolerated=tolerated))
        return replace(problem, blocks=tuple(blocks))

    made = world(4, samples=400, repeats=4)
    return tolerating(made.problem(0)), tolerating(made.problem(1))


def deviations(colours: Colours, size: int = 0) -> Array:
    """(m,) of the rows of the first block, what is lacking as large as a number of SIZES says."""
    count = colours.places[0].stop - colours.places[0].start
    whitening, _ = colours.of_block(0, size, np.eye(count))
    back = np.linalg.inv(whitening)
    return np.asarray(np.sqrt(np.sum(back**2, axis=1)))


def a_third_later(share: Array) -> Array:
    """In the first half of a repeat three times as much as in the second, of rms one."""
    return np.where(share < 0.5, 3.0, 1.0) / np.sqrt(5.0)


def test_more_is_tolerated_where_a_model_may_have_more_wrong(world: Callable[..., Any], asked: Asked) -> None:
    noise = deviations(asked(*problems(world, lambda share: 0 * share)).colours)
    found = deviations(asked(*problems(world, a_third_later)).colours)
    tolerated = np.sqrt(found**2 - noise**2)
    half = len(found) // 2
    assert tolerated[:half] == pytest.approx(3 * TOLERANCE / np.sqrt(5), rel=1e-3)
    assert tolerated[half:] == pytest.approx(TOLERANCE / np.sqrt(5), rel=1e-3)


def test_without_a_shape_it_is_the_same_all_along(world: Callable[..., Any], asked: Asked) -> None:
    plain = deviations(asked(*problems(world, None)).colours)
    even = deviations(asked(*problems(world, np.ones_like)).colours)
    assert plain == pytest.approx(even, rel=1e-12)


def test_what_is_lacking_has_the_shape_of_noise_and_tolerance(world: Callable[..., Any], asked: Asked) -> None:
    colours = asked(*problems(world, a_third_later)).colours
    usual = deviations(colours)
    for size, times in enumerate(SIZES):
        assert deviations(colours, size) == pytest.approx(np.hypot(1, times) * usual, rel=1e-6)

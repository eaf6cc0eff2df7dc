"""Evidence is divided by how far rows scatter beyond what their noise says."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from ident.diagnosis.evidence.misfit import BELIEVED, Scatter, scatter_along

NOTHING = np.zeros((0, 3)), np.zeros(0)
STRETCHES = 3000


def rows(copies: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """White columns, target and stretches, every row so many times: as if each copy had noise of its own."""
    draw = np.random.default_rng(copies)
    columns = draw.normal(size=(STRETCHES, 3))
    target = columns @ [2.0, -1.0, 0.5] + draw.normal(size=STRETCHES)
    repeated = [np.repeat(one, copies, axis=0) for one in (columns, target, np.arange(STRETCHES))]
    return repeated[0], repeated[1], repeated[2]


def excess_along(*rows: Any) -> list[float]:
    """What likelihoods of members are tempered by."""
    return [one.excess for one in scatter_along(*rows)]


def test_rows_of_white_noise_are_taken_as_they_are() -> None:
    white, target, stretch = rows(1)
    ratios = excess_along(white, target, NOTHING, stretch, [slice(0, 1), slice(1, 3)])
    assert ratios == pytest.approx([1.0, 1.0], abs=0.2)
    assert min(ratios) >= 1.0


@pytest.mark.parametrize("copies", [4, 10])
def test_a_row_said_many_times_is_said_once(copies: int) -> None:
    white, target, stretch = rows(copies)
    ratios = excess_along(white, target, NOTHING, stretch, [slice(0, 1), slice(1, 3)])
    assert ratios == pytest.approx([copies, copies], rel=0.25)


def test_what_is_known_otherwise_does_not_scatter() -> None:
    white, target, stretch = rows(10)
    known = np.array([[1e4, 0.0, 0.0]]), np.array([2e4])
    ratios = excess_along(white, target, known, stretch, [slice(0, 1), slice(1, 3)])
    assert ratios[0] == pytest.approx(1.0, abs=0.01)
    assert ratios[1] > 5


def few_noisy(draws: int) -> list[Scatter]:
    """Along a column that three of sixty stretches have, which are three times as noisy as is thought."""
    draw, stretch = np.random.default_rng(5), np.repeat(np.arange(60), 10)
    white = draw.normal(size=(600, 3))
    white[stretch > 2, 1] = 0.0
    noise = np.where(stretch > 2, 1.0, 3.0) * draw.normal(size=(draws, 600))
    targets = draw.normal(size=(draws, 3)) @ white.T + noise
    return [scatter_along(white, target, NOTHING, stretch, [slice(1, 2)])[0] for target in targets]


def test_the_scatter_of_few_stretches_is_told_though_what_is_fitted_follows_their_rows() -> None:
    """By two degrees of freedom."""
    found = few_noisy(400)
    assert np.mean([one.told / one.expected for one in found]) == pytest.approx(9.0, rel=0.15)
    assert [one.freedom for one in found] == pytest.approx([2.0] * 400, rel=0.2)


def test_the_scatter_of_few_stretches_is_believed_as_far_as_its_degrees_of_freedom_go() -> None:
    """Two, against those of what is believed."""
    told = 2 / (2 + BELIEVED)
    assert np.mean([one.excess for one in few_noisy(400)]) == pytest.approx(told * 9 + (1 - told), rel=0.15)


def test_few_stretches_of_white_noise_say_little() -> None:
    """Variances of two degrees of freedom, each shrunk to one."""
    draw, stretch = np.random.default_rng(7), np.repeat(np.arange(60), 10)
    white = draw.normal(size=(600, 3))
    white[stretch > 2, 1] = 0.0
    targets = white @ [2.0, 5.0, -5.0] + draw.normal(size=(400, 600))
    ratios = [excess_along(white, target, NOTHING, stretch, [slice(1, 2)])[0] for target in targets]
    told = 2 / (2 + BELIEVED)
    assert np.quantile(ratios, 0.95) == pytest.approx(1 + told * (stats.chi2(2).ppf(0.95) / 2 - 1), rel=0.15)


@given(told=st.floats(0.0, 20.0), freedom=st.floats(0.0, 1e3))
def test_what_is_believed_of_a_scatter_lies_between_what_it_says_and_what_the_noise_does(
    told: float, freedom: float
) -> None:
    assert 1.0 <= Scatter(told, 1.0, freedom).excess <= max(told, 1.0)
    assert Scatter(told, 1.0, BELIEVED).excess == pytest.approx(max((told + 1) / 2, 1.0))


def test_what_a_single_stretch_tells_is_taken_as_it_is() -> None:
    draw, stretch = np.random.default_rng(6), np.repeat(np.arange(60), 10)
    white = draw.normal(size=(600, 3))
    white[:, 1] = 1e5 * (stretch == 7)
    target = white @ [2.0, 5e-5, -5.0] + 3.0 * draw.normal(size=600)
    assert excess_along(white, target, NOTHING, stretch, [slice(1, 2)]) == pytest.approx([1.0], abs=0.01)


def test_columns_of_a_plant_of_which_next_to_nothing_is_known_lose_no_digit() -> None:
    """Inertias in units of a prior that is a hundred million times as wide as what rows tell, nearly the same."""
    draw, stretch = np.random.default_rng(8), np.repeat(np.arange(60), 10)
    first, second, member = draw.normal(size=(3, 600))
    target = 3e4 * first - 2e3 * second + 4 * member + draw.normal(size=600)
    far_apart = np.column_stack([1e8 * first, 100 * second, member])
    nearly_the_same = np.column_stack([1e8 * first, 1e8 * first + 100 * second, member])
    (apart,), (nearly,) = (
        scatter_along(white, target, NOTHING, stretch, [slice(2, 3)]) for white in (far_apart, nearly_the_same)
    )
    assert (nearly.told, nearly.freedom) == pytest.approx((apart.told, apart.freedom), rel=1e-3)

"""Intervals and calibration, against SciPy and against simulated truth."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from hil.exam.statistics import Rate, calibration_error, rate, reliability


@given(st.integers(1, 400).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_the_interval_is_wilsons(counts: tuple[int, int]) -> None:
    hits, cases = counts
    expected = stats.binomtest(hits, cases).proportion_ci(0.95, method="wilson")
    assert Rate(hits, cases).interval == pytest.approx((expected.low, expected.high), abs=1e-6)


def test_a_rate_counts() -> None:
    assert str(rate([True, True, False])) == "0.67 [0.21, 0.94] (2/3)"
    assert str(rate([])) == "no cases"


def test_probabilities_that_come_true_as_often_as_stated_are_calibrated() -> None:
    generator = np.random.default_rng(1)
    stated = generator.uniform(0.2, 1.0, 20000)
    right = generator.uniform(size=20000) < stated
    bins = reliability(stated.tolist(), right.tolist())
    assert [each.right.cases for each in bins] == [4000] * 5
    assert calibration_error(bins) < 0.02


def test_overconfidence_is_an_error_of_its_size() -> None:
    generator = np.random.default_rng(2)
    right = generator.uniform(size=20000) < 0.6
    assert calibration_error(reliability([0.9] * 20000, right.tolist())) == pytest.approx(0.3, abs=0.02)

"""Probabilities of a source, calibrated on the others: what they are worth where they were not set."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import expit, logit

from hil.exam.recalibration import Scaling, Statement, each_left_out, log_score, scaling_of

AS_STATED = Scaling()


def statements(count: int, seed: int, *, true: Scaling = AS_STATED) -> list[Statement]:
    """Drawn so that what is stated is right as often as `true` makes of it."""
    generator = np.random.default_rng(seed)
    stated = expit(generator.uniform(-2.0, 4.0, size=count))
    return list(zip(stated.tolist(), (generator.random(count) < true.of(stated)).tolist(), strict=True))


def test_a_scaling_is_recovered() -> None:
    true = Scaling(-0.6, 0.5)
    found = scaling_of(statements(20_000, 1, true=true))
    assert (found.shift, found.slope) == pytest.approx((true.shift, true.slope), abs=0.05)


def test_what_is_calibrated_stays_as_it_is() -> None:
    found = scaling_of(statements(20_000, 2))
    assert (found.shift, found.slope) == pytest.approx((0.0, 1.0), abs=0.06)


def test_statements_that_are_all_alike_become_how_often_they_are_right() -> None:
    found = scaling_of([(0.95, number % 4 != 0) for number in range(400)])
    assert float(found.of(np.array([0.95]))[0]) == pytest.approx(0.75, abs=0.01)


def test_a_source_is_scaled_by_the_others_alone() -> None:
    overconfident = Scaling(0.0, 0.4)
    sources = {"a": statements(5000, 3, true=overconfident), "b": statements(5000, 4, true=overconfident)}
    alone = sources | {"c": statements(5000, 5)}
    left = each_left_out(alone)
    # c is as it states itself: the others, which are overconfident, make it worse, and it makes them a little worse.
    assert left["c"].error > 2 * left["c"].stated_error
    assert left["a"].error < left["a"].stated_error
    assert left["a"].scaling == scaling_of(alone["b"] + alone["c"])
    assert left["a"].log_score > left["a"].stated_log_score


def test_what_tells_right_from_wrong_scores_better_than_how_many_are_right() -> None:
    left = each_left_out({"a": statements(4000, 6), "b": statements(4000, 7)})
    assert all(one.log_score > one.base_log_score for one in left.values())


def test_one_source_leaves_none_out() -> None:
    assert not each_left_out({"a": statements(10, 8), "b": []})


def test_the_log_score_is_that_of_what_was_true() -> None:
    assert log_score(np.array([0.8, 0.8]), np.array([True, False])) == pytest.approx(np.log(0.8 * 0.2) / 2)
    assert Scaling().of(np.array([0.3])) == pytest.approx([expit(logit(0.3))])

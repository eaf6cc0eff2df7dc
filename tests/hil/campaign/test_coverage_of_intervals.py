"""The test of the intervals over many campaigns, on made-up campaigns."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from hil.bench.truth import truth_of
from hil.campaign.study import Coverage, Outcome, accuracy, coverage, coverages, honest

RUNS = 30


def campaigns(vehicle: str, factor: float, seed: int) -> list[Outcome]:
    """Normal errors of 1 %, with intervals `factor` times as wide as they should be."""
    truth = truth_of(vehicle).values
    generator = np.random.default_rng(seed)
    found = []
    for number in range(RUNS):
        values = truth * (1 + 0.01 * generator.normal(size=len(truth)))
        half_widths = factor * 1.96 * 0.01 * truth
        intervals = np.stack([values - half_widths, values + half_widths], axis=1)
        found.append(Outcome(number, values, intervals, 5.0, 0.01, 0.01))
    return found


def both(factor: float, seed: int = 2) -> list[Coverage]:
    return coverages(
        accuracy(campaigns(vehicle, factor, seed + number), truth_of(vehicle))
        for number, vehicle in enumerate(("prototype", "compact"))
    )


def test_both_vehicles_are_counted_together() -> None:
    found = both(1.0)
    assert [one.runs for one in found] == [2 * RUNS] * 11
    assert coverage(found) == sum(one.covered for one in found) / (11 * 2 * RUNS)


def test_intervals_as_wide_as_they_should_be_pass() -> None:
    assert honest(both(1.0))


@pytest.mark.parametrize("factor", [0.85, 1.2])
def test_intervals_that_are_too_narrow_or_needlessly_wide_do_not(factor: float) -> None:
    assert not honest(both(factor))


def test_one_parameter_that_misses_too_often_is_enough() -> None:
    found = [Coverage("m_ch", 52, 60), *[Coverage("other", 58, 60)] * 10]
    assert 0.935 < coverage(found) < 0.965
    assert not honest(found)
    assert honest([Coverage("m_ch", 53, 60), *found[1:]])


def test_the_chance_is_that_of_so_many_misses_or_more() -> None:
    assert Coverage("m_ch", 60, 60).chance == pytest.approx(1.0)
    expected = sum(stats.binom.pmf(misses, 60, 0.05) for misses in range(8, 61))
    assert Coverage("m_ch", 52, 60).chance == pytest.approx(expected)

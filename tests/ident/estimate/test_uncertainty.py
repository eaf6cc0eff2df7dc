"""Standard deviations under coloured noise and repeated model error, on a small linear problem by Monte-Carlo."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import signal, stats

from ident.estimate.least_squares import LinearSystem, solve
from ident.estimate.uncertainty import ErrorCovariance, FittedRows, error_covariance, interval_factor

Array = NDArray[np.float64]

SAMPLE_TIME = 0.002
PERIOD = 2000
TRUTH = np.array([1.0, -2.0, 0.5])
Error = Callable[[np.random.Generator, int], Array]


def coloured(generator: np.random.Generator, samples: int, memory: float = 0.95) -> Array:
    """AR(1) of unit variance, the sampled Ornstein-Uhlenbeck process."""
    drive = generator.normal(size=samples + 500) * np.sqrt(1 - memory**2)
    return np.asarray(signal.lfilter([1], [1, -memory], drive)[500:])


def noise(generator: np.random.Generator, periods: int) -> Array:
    return coloured(generator, periods * PERIOD)


def repeated(generator: np.random.Generator, periods: int) -> Array:
    """The same error in every period, as friction that the model lacks would make."""
    return np.tile(coloured(generator, PERIOD), periods)


def regressor(periods: int) -> tuple[Array, NDArray[np.int64]]:
    phase = 2 * np.pi * np.arange(PERIOD) / PERIOD
    columns = (np.sin(phase) + 0.5 * np.cos(3 * phase), np.sign(np.sin(2 * phase + 0.3)), np.cos(phase))
    return np.tile(np.stack(columns, axis=1), (periods, 1)), np.repeat(np.arange(periods), PERIOD)


@dataclass(frozen=True)
class Trial:
    """Means over many draws: share of intervals that hold the truth, standard deviations over the true spread."""

    coverage: Array
    naive_coverage: Array
    mean_std: Array
    spread: Array


def trial(error: Error, periods: int, draws: int = 250, labelled: bool = True) -> Trial:
    generator = np.random.default_rng(7)
    x, numbers = regressor(periods)
    labels = numbers if labelled else np.full(len(x), -1)
    found, inside, naive_inside, deviations = [], [], [], []
    for _ in range(draws):
        solution = solve(LinearSystem(("a", "b", "c"), x, x @ TRUTH + error(generator, periods)))
        rows = FittedRows(x, solution.influence, solution.residual, np.ones(len(x), dtype=bool), labels, SAMPLE_TIME)
        stated = error_covariance([rows])
        std = np.sqrt(np.diag(stated.matrix))
        naive = np.sqrt(np.diag(solution.normal_inverse) * np.var(solution.residual))
        miss = np.abs(solution.values - TRUTH)
        factors = np.array([interval_factor(freedom) for freedom in stated.degrees_of_freedom])
        inside.append(miss < factors * std)
        naive_inside.append(miss < 1.96 * naive)
        found.append(solution.values)
        deviations.append(std)
    return Trial(np.mean(inside, 0), np.mean(naive_inside, 0), np.mean(deviations, 0), np.std(found, 0))


@pytest.mark.parametrize("labelled", [True, False], ids=["in periods", "without periods"])
def test_intervals_hold_the_truth_under_coloured_noise_and_naive_ones_do_not(labelled: bool) -> None:
    found = trial(noise, periods=4, labelled=labelled)
    assert np.all(found.coverage >= 0.90)
    assert np.all(found.coverage <= 0.99)
    assert np.all(found.naive_coverage < 0.5)


def test_noise_averages_out_with_more_periods() -> None:
    few, many = trial(noise, 2, draws=80), trial(noise, 8, draws=80)
    np.testing.assert_allclose(many.mean_std / few.mean_std, np.sqrt(2 / 8), rtol=0.15)
    np.testing.assert_allclose(many.spread / few.spread, np.sqrt(2 / 8), rtol=0.3)


def test_repeated_model_error_does_not_average_out_with_more_periods() -> None:
    few, many = trial(repeated, 2, draws=60), trial(repeated, 8, draws=60)
    np.testing.assert_allclose(many.mean_std / few.mean_std, 1.0, rtol=0.1)
    np.testing.assert_allclose(many.spread / few.spread, 1.0, rtol=1e-6)


def test_repeated_model_error_is_counted_as_such() -> None:
    """Taken for noise it would be divided by the number of periods; the naive interval holds a tenth."""
    found = trial(repeated, periods=4)
    assert np.all(found.coverage >= 0.90)
    assert np.all(found.naive_coverage < 0.25)


def test_white_noise_needs_no_correction() -> None:
    def white(generator: np.random.Generator, periods: int) -> Array:
        return generator.normal(size=periods * PERIOD)

    found = trial(white, 4, draws=80)
    x, _ = regressor(4)
    expected = np.sqrt(np.diag(np.linalg.inv(x.T @ x)))
    np.testing.assert_allclose(found.mean_std, expected, rtol=0.2)


def part(generator: np.random.Generator, samples: int = 4000) -> FittedRows:
    x = generator.normal(size=(samples, 2))
    residual = generator.normal(size=samples)
    kept, period = np.ones(samples, dtype=bool), np.repeat(np.arange(4), samples // 4)
    return FittedRows(x, x, residual, kept, period, SAMPLE_TIME)


def test_independent_parts_add_their_covariances() -> None:
    generator = np.random.default_rng(0)
    parts = [part(generator) for _ in range(2)]
    together = error_covariance(parts)
    one, other = (error_covariance([part]) for part in parts)
    np.testing.assert_allclose(together.matrix, one.matrix + other.matrix)
    assert np.all(together.degrees_of_freedom > np.maximum(one.degrees_of_freedom, other.degrees_of_freedom))


def test_every_parameter_has_the_degrees_of_freedom_of_the_part_that_shows_it() -> None:
    sharp = ErrorCovariance(np.diag([1.0, 0.0, 1.0]), np.full(3, 5.0))
    broad = ErrorCovariance(np.diag([0.0, 1.0, 1.0]), np.full(3, 80.0))
    found = ErrorCovariance.total([sharp, broad])
    np.testing.assert_allclose(found.degrees_of_freedom, [5.0, 80.0, 4 / (1 / 5 + 1 / 80)])


def test_an_error_that_is_known_not_to_be_needs_no_degrees_of_freedom() -> None:
    found = ErrorCovariance.total([ErrorCovariance(np.zeros((1, 1)), np.zeros(1))])
    assert interval_factor(float(found.degrees_of_freedom[0])) == pytest.approx(1.959964, abs=1e-6)


def test_the_covariance_goes_with_the_inverse_normal_matrix_from_both_sides() -> None:
    generator = np.random.default_rng(1)
    rows, inverse = part(generator), np.array([[2.0, 0.3], [0.3, 1.0]])
    plain = error_covariance([rows]).matrix
    moved = replace(rows, influence=rows.regressor @ inverse)
    np.testing.assert_allclose(error_covariance([moved]).matrix, inverse @ plain @ inverse, rtol=1e-9)


def test_what_stands_in_dropped_rows_does_not_matter() -> None:
    rows = part(np.random.default_rng(2))
    kept = np.arange(4000) % 1000 > 300
    clean = replace(rows, kept=kept)
    spoilt = replace(clean, regressor=np.where(kept[:, None], rows.regressor, 1e6))
    spoilt = replace(spoilt, residual=np.where(kept, rows.residual, -1e6), influence=spoilt.regressor)
    np.testing.assert_allclose(error_covariance([spoilt]).matrix, error_covariance([clean]).matrix, rtol=1e-9)


def test_few_degrees_of_freedom_widen_the_interval() -> None:
    assert interval_factor(np.inf) == pytest.approx(1.959964, abs=1e-6)
    assert interval_factor(5.0) == pytest.approx(2.570582, abs=1e-6)
    assert interval_factor(0.2) == interval_factor(1.0)
    assert interval_factor(8.0, level=0.9) == pytest.approx(stats.t(8).interval(0.9)[1])

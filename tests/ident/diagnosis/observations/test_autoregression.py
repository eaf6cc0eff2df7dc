"""The colour of rows is that of the process they are drawn from, also where its spectrum falls by many orders."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import linalg, signal

from ident.diagnosis.observations.autoregression import ORDER, autocovariance

Array = NDArray[np.float64]
LENGTH = 600


def run(seed: int, poles: float, length: int = LENGTH) -> Array:
    """Of an autoregression of second order with both poles at the same place; innovations of unit variance."""
    drawn = np.random.default_rng(seed).normal(size=length + 2000)
    return np.asarray(signal.lfilter([1.0], np.poly([poles, poles]), drawn))[2000:]


def by_the_window(values: Array) -> Array:
    """Autocovariance as Yule and Walker have it."""
    return np.array([values[lag:] @ values[: len(values) - lag] for lag in range(ORDER + 1)]) / len(values)


def error_of(covariance: Array) -> float:
    """Standard deviation of predictions by an autocovariance, by its normal equations."""
    weights = linalg.solve_toeplitz(covariance[:-1], covariance[1:])
    return float(np.sqrt(covariance[0] - weights @ covariance[1:]))


@pytest.mark.parametrize("poles", [0.0, 0.5, 0.9])
def test_the_autocovariance_is_that_of_the_process(poles: float) -> None:
    impulse = np.zeros(5000)
    impulse[0] = 1.0
    response = signal.lfilter([1.0], np.poly([poles, poles]), impulse)
    truth = np.array([response[lag:] @ response[: len(response) - lag] for lag in range(4)])
    found = np.mean([autocovariance(one, np.arange(LENGTH))[:4] for one in (run(n, poles) for n in range(40))], axis=0)
    assert found == pytest.approx(truth, rel=0.1, abs=0.1)


def test_of_steep_spectra_the_fast_part_is_not_that_of_the_window() -> None:
    """Innovations have unit variance; through a window of 600 rows they seem to have a thousand times as much."""
    drawn = [run(seed, 0.995) for seed in range(20)]
    own = np.median([error_of(autocovariance(one, np.arange(LENGTH))) for one in drawn])
    other = np.median([error_of(by_the_window(one)) for one in drawn])
    assert own == pytest.approx(1.0, abs=0.1)
    assert other > 10


def test_runs_are_not_taken_for_one() -> None:
    """A step from one run to the next is no innovation."""
    first, second = run(1, 0.9), run(2, 0.9)
    age = np.tile(np.arange(LENGTH), 2)
    both = autocovariance(np.concatenate([first, second]), age)
    assert both[0] == pytest.approx(np.mean(np.concatenate([first, second]) ** 2))
    kept = [autocovariance(one, np.arange(LENGTH)) for one in (first, second)]
    assert error_of(both) == pytest.approx(np.mean([error_of(one) for one in kept]), rel=0.05)
    apart = autocovariance(np.concatenate([first + 500, second - 500]), np.arange(2 * LENGTH))
    assert error_of(apart) > 2 * error_of(both)


def test_few_rows_at_the_ends_of_the_longest_runs_say_nothing_of_their_lags() -> None:
    """Most runs end at a reversal: only one of these reaches further than ten rows."""
    whitened = []
    for seed in range(20):
        runs = [run(100 * seed + number, 0.6, length) for number, length in enumerate([*[10] * 40, 21])]
        age = np.concatenate([np.arange(len(one)) for one in runs])
        covariance = linalg.toeplitz(autocovariance(np.concatenate(runs), age))
        fresh = run(100 * seed + 99, 0.6, ORDER + 1)
        whitened.append(
            np.mean(linalg.solve_triangular(linalg.cholesky(covariance, lower=True), fresh, lower=True) ** 2)
        )
    assert np.mean(whitened) == pytest.approx(1.0, abs=0.25)


@pytest.mark.parametrize("values", [np.ones(400), run(3, 0.99), np.tile([1.0, -1.0], 200)])
def test_the_autocovariance_is_one_that_a_process_can_have(values: Array) -> None:
    found = autocovariance(values, np.arange(len(values)))
    assert np.linalg.eigvalsh(linalg.toeplitz(found)).min() > -1e-9 * found[0]


def test_of_nothing_there_is_none() -> None:
    assert not autocovariance(np.zeros(50), np.arange(50)).any()

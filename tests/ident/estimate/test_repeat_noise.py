"""Noise by the differences between repeats: what it makes of intervals where the noise is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import signal

from ident.estimate.filters import zero_phase
from ident.estimate.repeat_noise import mean_of_repeats, noise_between, propagated, propagated_noise
from ident.estimate.uncertainty import FittedRows, error_covariance, interval_factor

Array = NDArray[np.float64]

SAMPLE_TIME = 0.01
SAMPLES = 500
MEMORY = 0.1
CUTOFF = 40.0


def ornstein_uhlenbeck(generator: np.random.Generator, samples: int, draws: int) -> Array:
    """(draws, samples) of unit variance, as the load of a drive fluctuates, through the filter of the estimate."""
    decay = np.exp(-SAMPLE_TIME / MEMORY)
    drive = generator.normal(size=(samples + 100, draws)) * np.sqrt(1 - decay**2)
    return zero_phase(signal.lfilter([1], [1, -decay], drive, axis=0)[100:], CUTOFF, SAMPLE_TIME).T


def motion() -> tuple[Array, NDArray[np.bool_]]:
    """Acceleration, speed and its sign over one period, most of it in one long stroke; rows near standstill dropped."""
    time = SAMPLE_TIME * np.arange(SAMPLES)
    angle = 2 * np.pi * time / time[-1]
    speed = np.sin(angle) * np.exp(np.cos(angle)) + 0.5 * np.sin(3 * angle)
    regressor = np.stack([np.gradient(speed, SAMPLE_TIME), speed, np.sign(speed)], axis=1)
    return zero_phase(regressor, CUTOFF, SAMPLE_TIME), np.abs(speed) > 0.15


@dataclass(frozen=True)
class Draws:
    """Errors (draws, 3) of a fit, with the standard deviations and degrees of freedom that were stated."""

    error: Array
    std: Array
    degrees_of_freedom: Array

    @property
    def covered(self) -> NDArray[np.bool_]:
        factors = np.vectorize(interval_factor)(self.degrees_of_freedom)
        return np.asarray(np.abs(self.error) <= factors * self.std)


def draws(periods: int, count: int, seed: int = 5, grows_with_speed: bool = False) -> Draws:
    regressor, moving = motion()
    size = np.abs(regressor[:, 1]) if grows_with_speed else np.ones(SAMPLES)
    x, kept = np.tile(regressor, (periods, 1)), np.tile(moving, periods)
    inverse = np.linalg.inv(x[kept].T @ x[kept])
    numbers = np.repeat(np.arange(periods), SAMPLES)
    found = []
    for noise in ornstein_uhlenbeck(np.random.default_rng(seed), len(x), count) * np.tile(size, periods):
        error = inverse @ (x[kept].T @ noise[kept])
        rows = FittedRows(x, x @ inverse, noise - x @ error, kept, numbers, SAMPLE_TIME)
        stated = error_covariance([rows])
        found.append((error, np.sqrt(np.diag(stated.matrix)), stated.degrees_of_freedom))
    return Draws(*(np.array(column) for column in zip(*found, strict=True)))


@pytest.fixture(scope="module", params=[3, 4, 6])
def fitted(request: pytest.FixtureRequest) -> Draws:
    return draws(request.param, 250)


def test_intervals_hold_as_often_as_they_state_with_few_periods(fitted: Draws) -> None:
    """0.95 of 250 draws of one parameter scatter by 0.014."""
    assert 0.935 < fitted.covered.mean() < 0.965
    assert np.all(fitted.covered.mean(axis=0) > 0.91)
    assert np.all(fitted.covered.mean(axis=0) < 0.98)


def test_intervals_hold_where_noise_grows_with_speed() -> None:
    """Viscous friction has its rows where the noise is large; by one size for all rows its interval is too narrow."""
    found = draws(6, 250, grows_with_speed=True)
    assert 0.93 < found.covered.mean() < 0.97
    assert np.all(found.covered.mean(axis=0) > 0.91)


def test_standard_deviations_are_those_of_the_errors(fitted: Draws) -> None:
    np.testing.assert_allclose(np.sqrt(np.mean(fitted.std**2, axis=0)), fitted.error.std(axis=0), rtol=0.1)


def test_degrees_of_freedom_tell_how_much_a_variance_scatters() -> None:
    regressor, moving = motion()
    influence = np.tile(np.where(moving[:, None], regressor, 0.0), (6, 1))
    noise = ornstein_uhlenbeck(np.random.default_rng(5), len(influence), 300).reshape(-1, 6, SAMPLES)
    samples = np.arange(len(influence)).reshape(6, SAMPLES)
    found = [propagated_noise(noise_between(residual, moving), influence, samples) for residual in noise]
    variances = np.array([np.diag(matrix) for matrix, _ in found])
    scattered = 2 * variances.mean(axis=0) ** 2 / variances.var(axis=0)
    np.testing.assert_allclose(np.median([degrees for _, degrees in found], axis=0), scattered, rtol=0.3)


def test_an_influence_at_few_frequencies_has_few_degrees_of_freedom() -> None:
    """A slow sine hears little of the spectrum, a short pulse hears all of it."""
    generator = np.random.default_rng(0)
    found = noise_between(
        ornstein_uhlenbeck(generator, 4 * SAMPLES, 1).reshape(4, SAMPLES), np.ones(SAMPLES, dtype=bool)
    )
    phase = 2 * np.pi * np.arange(4 * SAMPLES) / SAMPLES
    pulse = (np.arange(4 * SAMPLES) % SAMPLES == 100).astype(float)
    _, degrees = propagated(found.colour, np.stack([np.sin(phase), pulse], axis=1))
    assert degrees[0] < 12
    assert degrees[1] > 3 * degrees[0]


def test_what_repeats_is_no_noise() -> None:
    pattern = np.tile(np.random.default_rng(0).normal(size=SAMPLES), (4, 1))
    noise = noise_between(pattern, np.ones(SAMPLES, dtype=bool))
    np.testing.assert_allclose(noise.colour.values, 0.0, atol=1e-12)
    assert mean_of_repeats(pattern, np.ones(SAMPLES, dtype=bool)).values[0] == pytest.approx(1.0, rel=0.2)


def test_white_noise_has_no_memory_and_as_many_independent_rows_as_samples() -> None:
    white = 2 * np.random.default_rng(3).normal(size=(60, SAMPLES))
    kept = np.arange(SAMPLES) < 400
    noise = noise_between(white, kept).colour
    assert noise.values[0] == pytest.approx(4.0, rel=0.03)
    np.testing.assert_allclose(noise.values[1:300], 0.0, atol=0.3)
    assert noise.pairs[0] == pytest.approx(400)
    assert noise.independent_rows == pytest.approx(400, rel=0.1)


def test_gaps_between_kept_rows_do_not_shrink_the_memory() -> None:
    """Strokes of 0.2 s with stiction between them: what is known of longer lags is by pairs across the gaps."""
    generator = np.random.default_rng(4)
    long = ornstein_uhlenbeck(generator, SAMPLES, 200)
    whole = noise_between(long, np.ones(SAMPLES, dtype=bool))
    gapped = noise_between(long, np.arange(SAMPLES) % 50 < 30)
    np.testing.assert_allclose(gapped.colour.values[:40], whole.colour.values[:40], atol=0.05)

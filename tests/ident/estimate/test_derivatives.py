"""Derivatives of signals that are fast beside their sampling."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ident.estimate.filters import SEVEN, differentiate, second_derivative

DT = 0.002


@pytest.mark.parametrize(("omega", "tolerance"), [(40.0, 1e-8), (220.0, 1e-4), (490.0, 6e-3)])
def test_a_sine_keeps_its_amplitude(omega: float, tolerance: float) -> None:
    values = np.sin(omega * DT * np.arange(2000))
    slope = np.cos(omega * DT * np.arange(2000))
    inner = slice(3, -3)
    assert differentiate(values, DT, SEVEN)[inner] @ slope[inner] / (slope[inner] @ slope[inner]) == pytest.approx(
        omega, rel=tolerance
    )
    assert -second_derivative(values, DT, SEVEN)[inner] @ values[inner] / (
        values[inner] @ values[inner]
    ) == pytest.approx(omega**2, rel=tolerance)


def test_polynomials_are_exact_and_ends_are_near() -> None:
    time = np.arange(30) * DT
    values = np.stack([(50 * time) ** 5, np.ones(30)], axis=1)
    assert differentiate(values, DT, SEVEN)[3:-3, 0] == pytest.approx(250 * (50 * time[3:-3]) ** 4, rel=1e-9)
    assert second_derivative(values, DT, SEVEN)[3:-3, 0] == pytest.approx(5e4 * (50 * time[3:-3]) ** 3, rel=1e-7)
    assert differentiate(time, DT, SEVEN) == pytest.approx(np.ones(30))
    assert np.all(differentiate(values, DT, SEVEN)[:, 1] == 0)


@pytest.mark.parametrize("count", [3, 4, 7])
def test_few_samples_have_derivatives_too(count: int) -> None:
    line = 2.0 * np.arange(count) * DT
    assert differentiate(line, DT, SEVEN) == pytest.approx(np.full(count, 2.0))
    assert second_derivative(line, DT, SEVEN) == pytest.approx(np.zeros(count), abs=1e-6)
    assert math.isfinite(float(differentiate(line, DT, SEVEN).sum()))

"""What a spectrum over the angles of several equals says, by least squares at its orders and by chance."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.diagnosis.observations.periodogram import Turned, periodogram

Array = NDArray[np.float64]

OFFSETS = (0.0, 0.3, 1.1, 2.0)


def turned(left: Array, path: Array, offsets: tuple[float, ...] = OFFSETS) -> Turned:
    """Rows of equals that turn together, from anywhere, all slow enough."""
    angles = path[:, None] + np.array(offsets)
    return Turned(angles, np.ones_like(angles), left, np.full_like(angles, 120.0))


def path_of(generator: np.random.Generator, rows: int = 900) -> Array:
    return np.asarray(np.sort(generator.uniform(0.0, 40.0, rows)))


@pytest.mark.parametrize("offsets", [(0.0,), OFFSETS, (0.0, 0.0, 0.0, 0.0), (0.0, 500.0)])
def test_noise_explains_as_much_by_equals_as_by_one(offsets: tuple[float, ...]) -> None:
    """Two degrees of freedom at every order: a mean of two, wherever equals begin."""
    generator = np.random.default_rng(1)
    means = []
    for _ in range(20):
        found = periodogram(turned(generator.normal(size=900), path_of(generator), offsets))
        assert found is not None
        means.append(found.explained[found.explained > 0].mean())
    assert np.mean(means) == pytest.approx(2.0, rel=0.15)


@pytest.mark.parametrize("order", [5.3, 11.7, 17.2, 23.9])
def test_what_it_explains_is_what_least_squares_explain(order: float) -> None:
    generator = np.random.default_rng(2)
    path = path_of(generator)
    waves = np.exp(1j * order * (path[:, None] + np.array(OFFSETS))).sum(axis=1)
    columns = np.column_stack([waves.real, waves.imag])
    left = columns @ np.array([0.3, -0.2]) + generator.normal(size=len(path))
    found = periodogram(turned(left, path))
    assert found is not None
    best = float(found.orders[np.argmax(found.explained)])
    assert best == pytest.approx(order, abs=found.resolution / 2)
    projected = columns @ np.linalg.lstsq(columns, left, rcond=None)[0]
    assert found.explained.max() == pytest.approx(float(projected @ projected), rel=0.05)


def test_equals_whose_levers_cancel_show_a_ripple_all_the_same() -> None:
    """As wheels of a rotation do: the sum of their levers is zero."""
    generator = np.random.default_rng(3)
    path = path_of(generator)
    angles = np.column_stack([path, 0.7 - path])
    levers = np.broadcast_to([1.0, -1.0], angles.shape)
    left = np.sum(levers * np.sin(9.4 * angles + 0.4), axis=1) + generator.normal(size=len(path))
    found = periodogram(Turned(angles, levers, left, np.full_like(angles, 120.0)))
    assert found is not None
    assert found.orders[np.argmax(found.explained)] == pytest.approx(9.4, abs=found.resolution / 2)


def test_what_does_not_turn_or_bears_nothing_shows_no_order() -> None:
    path = path_of(np.random.default_rng(4))
    left = np.ones(len(path))
    assert periodogram(turned(left, np.zeros(len(path)), (0.0,))) is None
    still = turned(left, path)
    assert periodogram(Turned(still.angles, np.zeros_like(still.levers), left, still.reach)) is None

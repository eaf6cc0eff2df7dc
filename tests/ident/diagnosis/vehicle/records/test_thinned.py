"""Signals at a lower rate."""

from __future__ import annotations

import numpy as np
import pytest

from ident.diagnosis.vehicle.records.signals import thinned

DT = 0.002


def wave(frequency: float, dt: float = DT) -> np.ndarray:
    return np.cos(2 * np.pi * frequency * np.arange(0.0, 4.0, dt))


@pytest.mark.parametrize("stride", [2, 4])
def test_what_is_near_the_new_rate_does_not_become_slow(stride: int) -> None:
    """Six hertz, where the filter of the rows ends, from the rate: of every so manieth sample alone it would be all."""
    fast = wave(1 / (DT * stride) - 6.0)
    assert np.abs(fast[::stride] - wave(6.0, DT * stride)).max() < 1e-9
    assert np.abs(thinned(fast, stride)[4:-4]).max() < 4e-3


@pytest.mark.parametrize("stride", [1, 2, 4])
def test_what_is_slow_stays_when_it_was(stride: int) -> None:
    slow = wave(2.0)
    np.testing.assert_allclose(thinned(slow, stride)[4:-4], slow[::stride][4:-4], atol=2e-3)


def test_signals_that_keep_their_rate_are_as_they_were() -> None:
    signals = np.random.default_rng(1).normal(size=(50, 3))
    np.testing.assert_array_equal(thinned(signals, 1), signals)

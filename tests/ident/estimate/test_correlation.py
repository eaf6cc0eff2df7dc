"""The correlation of a covariance."""

from __future__ import annotations

import numpy as np
import pytest

from ident.estimate.uncertainty import correlation_of


@pytest.mark.parametrize("seed", range(3))
def test_it_is_that_of_samples(seed: int) -> None:
    samples = np.random.default_rng(seed).normal(size=(5, 40)) * [[1e-6], [1.0], [3.0], [200.0], [1e7]]
    np.testing.assert_allclose(correlation_of(np.cov(samples)), np.corrcoef(samples), atol=1e-12)


def test_what_is_known_exactly_goes_with_nothing() -> None:
    np.testing.assert_array_equal(correlation_of(np.diag([4.0, 0.0])), np.eye(2))

"""What chance tells along a name has a square of one, and what is believed of scatter is found in what is drawn."""

from __future__ import annotations

import numpy as np
import pytest

from examples.scatter_along_names import likelihoods, square_along
from ident.diagnosis.evidence.misfit import Scatter


def test_squares_along_columns_are_those_of_chance() -> None:
    draw = np.random.default_rng(1)
    baseline, own = draw.normal(size=(200, 5)), draw.normal(size=(200, 2))
    own[:, 1] += baseline[:, 0]
    squares = [square_along(baseline, own, baseline @ draw.normal(size=5) + draw.normal(size=200)) for _ in range(2000)]
    assert np.mean(squares) == pytest.approx(1.0, abs=0.05)
    assert np.quantile(squares, 0.95) == pytest.approx(5.99 / 2, rel=0.1)


@pytest.mark.parametrize("believed", [4, 16])
def test_degrees_of_freedom_of_drawn_ratios_are_the_likeliest(believed: int) -> None:
    draw = np.random.default_rng(2)
    freedom = draw.uniform(2, 12, size=6000)
    true = believed / draw.chisquare(believed, size=6000)
    told = true * draw.chisquare(freedom) / freedom
    found = likelihoods([Scatter(one, 1.0, of, 1.0) for one, of in zip(told, freedom, strict=True)])
    assert max(found, key=found.__getitem__) == believed

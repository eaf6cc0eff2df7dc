"""What chance tells along a name has a square of one, and belief is as firm as what is drawn bears."""

from __future__ import annotations

import numpy as np
import pytest

from examples.scatter_along_names import FREEDOMS, Told, likelihood, square_along
from ident.diagnosis.evidence.misfit import Scatter


def test_squares_along_columns_are_those_of_chance() -> None:
    draw = np.random.default_rng(1)
    baseline, own = draw.normal(size=(200, 5)), draw.normal(size=(200, 2))
    own[:, 1] += baseline[:, 0]
    nothing = np.zeros((0, 5)), np.zeros(0)
    targets = [baseline @ draw.normal(size=5) + draw.normal(size=200) for _ in range(2000)]
    squares, ranks = zip(*(square_along(baseline, own, target, nothing) for target in targets), strict=True)
    assert set(ranks) == {2}
    assert np.mean(squares) == pytest.approx(1.0, abs=0.05)
    assert np.quantile(squares, 0.95) == pytest.approx(5.99 / 2, rel=0.1)


@pytest.mark.parametrize(("spread", "likeliest"), [(0.0, max(FREEDOMS)), (1.5, min(FREEDOMS))])
def test_the_firmest_belief_is_likeliest_of_noise_that_is_as_it_says_and_the_loosest_of_any(
    spread: float, likeliest: float
) -> None:
    draw, freedom = np.random.default_rng(2), 12.0
    true = np.exp(spread * draw.normal(size=20000))
    told = true * draw.chisquare(freedom, size=len(true)) / freedom
    squares = true * draw.chisquare(1, size=len(true))
    drawn = [Told(square, 1, Scatter(one, 1.0, freedom), False) for square, one in zip(squares, told, strict=True)]
    assert max(FREEDOMS, key=lambda of: likelihood(drawn, of)) == likeliest

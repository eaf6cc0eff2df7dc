"""Numbers that are tried first reach from one end to the other, none further from its neighbour than the ratio."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ident.diagnosis.observations.tried import RATIO, SMALLEST, tried_between


@given(st.floats(1e-6, 1e6), st.floats(1.0001, 1 / SMALLEST))
def test_they_are_at_equal_ratios_from_end_to_end(least: float, factor: float) -> None:
    found = np.array(tried_between(least, factor * least))
    ratios = found[1:] / found[:-1]
    assert found[0] == pytest.approx(least)
    assert found[-1] == pytest.approx(factor * least)
    assert ratios == pytest.approx(np.full(len(ratios), ratios[0]))
    assert 1 < ratios[0] <= RATIO * (1 + 1e-9)


def test_where_the_most_is_less_than_can_be_bounded_that_is_tried_alone() -> None:
    assert tried_between(2.0, 1.0) == (2.0,)


def test_rows_that_bound_nothing_ask_for_no_endless_list() -> None:
    found = tried_between(0.0, 2.0)
    assert found[0] == pytest.approx(SMALLEST * 2.0)
    assert found[-1] == pytest.approx(2.0)

"""Products of columns, some replaced and others integrated, are those of the matrix that nobody makes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ident.diagnosis.hypotheses.gram import Beside, Gram

COLUMNS, ROWS = 7, 12
PLACES = [slice(0, 2), slice(2, 5), slice(5, 7), slice(1, 6)]


def columns(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(ROWS, COLUMNS + 1))


@given(seed=st.integers(0, 10**6), replaced=st.sets(st.integers(0, COLUMNS), max_size=5))
def test_replaced_columns_have_the_products_of_the_new_ones(seed: int, replaced: set[int]) -> None:
    before, now, numbers = columns(seed), columns(seed), np.array(sorted(replaced), dtype=np.int64)[::-1]
    now[:, numbers] = columns(seed + 1)[:, numbers]
    whole = now.T @ now
    gram = Gram(before.T @ before, numbers, whole[numbers])
    some = np.array([0, 2, 3, 6])
    assert gram.columns(some) == pytest.approx(whole[:, some])
    assert gram.among(some) == pytest.approx(whole[np.ix_(some, some)])
    assert gram.target == pytest.approx(whole[-1])
    assert gram.diagonal == pytest.approx(np.diag(whole))
    for place in PLACES:
        for other in PLACES:
            assert gram.of(place, other) == pytest.approx(whole[place, other])


def test_what_is_replaced_is_written_to_a_copy() -> None:
    whole = columns(1).T @ columns(1)
    gram = Gram(whole.copy(), np.array([1, COLUMNS]), np.ones((2, COLUMNS + 1)))
    assert gram.of(PLACES[0], PLACES[3])[1, 0] == 1.0
    assert gram.columns(np.array([1, 2]))[0, 0] == 1.0
    assert gram.among(np.array([0, 1]))[0, 1] == 1.0
    assert gram.whole == pytest.approx(whole)


@given(seed=st.integers(0, 10**6))
def test_beside_integrated_directions_products_are_by_the_covariance_that_those_add(seed: int) -> None:
    """Directions of unit variance are noise of the rows: 1 + D Dᵀ."""
    own, directions = columns(seed), np.linalg.qr(columns(seed + 1)[:, :2])[0] * [0.7, 3.0]
    covariance = np.eye(ROWS) + directions @ directions.T
    expected = own.T @ np.linalg.solve(covariance, own)
    beside = Beside(Gram.of_all(own.T @ own), own.T @ directions, np.sum(directions**2, axis=0))
    assert beside.of(PLACES[1], PLACES[3]) == pytest.approx(expected[PLACES[1], PLACES[3]])
    assert beside.along[PLACES[2]] == pytest.approx(expected[PLACES[2], -1])
    assert beside.diagonal == pytest.approx(np.diag(expected))


@given(seed=st.integers(0, 10**6), bent=st.booleans())
def test_what_acts_in_other_rows_is_untouched(seed: int, bent: bool) -> None:
    """The first three columns act in the first rows alone, the others in the last ones, as two axes do."""
    own = columns(seed)
    own[6:, :3] = own[:6, 3:COLUMNS] = 0.0
    now, numbers = own.copy(), np.array([1, COLUMNS] if bent else [], dtype=np.int64)
    now[:6, numbers] += columns(seed + 1)[:6, numbers]
    whole, rows = own.T @ own, (now.T @ now)[numbers]
    rows[:, 3:COLUMNS] = whole[3:COLUMNS, numbers].T
    gram = Gram(whole, numbers, rows)
    directions = np.zeros((ROWS, 1))
    directions[:6] = 0.1
    beside = Beside(gram, now.T @ directions, np.array([0.06]))
    assert not beside.untouched[:3].any()
    for place in (slice(3, 5), slice(5, COLUMNS)):
        assert beside.untouched[place].all()
        assert beside.of(place, place) == pytest.approx(whole[place, place])
        assert beside.along[place] == pytest.approx(whole[place, -1])

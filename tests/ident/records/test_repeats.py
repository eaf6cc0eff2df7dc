"""Repeats stand beside each other, phase by phase."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ident.records.repeats import repeats_of


@given(st.lists(st.integers(2, 9), min_size=2, max_size=5), st.integers(0, 4), st.integers(0, 4))
def test_every_row_is_one_repeat_from_its_start(lengths: list[int], before: int, after: int) -> None:
    numbered = np.repeat(np.arange(len(lengths)), lengths)
    period = np.concatenate([np.full(before, -1), numbered, np.full(after, -1)])
    samples = repeats_of(period)
    assert samples.shape == (len(lengths), min(lengths))
    starts = before + np.cumsum([0, *lengths[:-1]])
    np.testing.assert_array_equal(samples, starts[:, None] + np.arange(min(lengths)))


@pytest.mark.parametrize("period", [[-1, -1, -1], [-1, 0, 0], [3, 3, 3]])
def test_what_does_not_repeat_is_taken_as_a_whole(period: list[int]) -> None:
    np.testing.assert_array_equal(repeats_of(np.array(period)), [[0, 1, 2]])

"""What follows within a play is where the step by step definition says."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from ident.plant.play import behind_play

SAMPLES = arrays(np.float64, st.integers(1, 70), elements=st.floats(-3, 3, allow_subnormal=False))


@given(SAMPLES, st.floats(0, 2, allow_subnormal=False), st.floats(-5, 5, allow_subnormal=False))
def test_it_is_pushed_only_by_the_ends_of_the_play(driving: np.ndarray, half: float, start: float) -> None:
    followed, expected = start, []
    for value in driving.tolist():
        followed = min(max(followed, value - half), value + half)
        expected.append(followed)
    assert behind_play(driving, half, start).tolist() == expected


@given(SAMPLES, st.floats(0.01, 2, allow_subnormal=False))
def test_without_reversals_it_is_half_the_play_behind(driving: np.ndarray, half: float) -> None:
    rising = np.sort(driving)
    found = behind_play(rising, half, rising[0] - half)
    np.testing.assert_array_equal(found, rising - half)

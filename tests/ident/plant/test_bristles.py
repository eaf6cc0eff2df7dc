"""Bristles along angles are where step by step they are bent to."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from ident.plant.bristles import bent_along

ANGLES = arrays(np.float64, st.integers(1, 70), elements=st.floats(-2, 2, allow_subnormal=False))


@given(ANGLES, st.floats(1e-3, 10))
def test_along_any_angles_they_are_bent_as_step_by_step(angles: np.ndarray, angle: float) -> None:
    bent, expected = 0.0, [0.0]
    for turned in np.diff(angles).tolist():
        bent = np.sign(turned) + (bent - np.sign(turned)) * np.exp(-abs(turned) / angle)
        expected.append(float(bent))
    assert bent_along(angles, angle) == pytest.approx(np.array(expected), abs=1e-12)


def test_over_a_long_way_they_stand_against_the_motion_and_turn_over_within_their_angle() -> None:
    angles = np.concatenate([np.linspace(0, 1, 2001), np.linspace(1, 0, 2001)[1:]])
    bent = bent_along(angles, 0.05)
    assert bent[2000] == pytest.approx(1.0, abs=1e-8)
    assert bent[2100] == pytest.approx(-1 + 2 * np.exp(-1))

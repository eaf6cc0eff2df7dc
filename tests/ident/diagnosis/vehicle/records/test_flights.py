"""Where a motor is that flies in the play of its gear: by the law of the contact alone, and by Newton's."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ident.diagnosis.vehicle.records.flights import Shaken, twist_in_flight
from ident.diagnosis.vehicle.records.rattling import above_band
from ident.estimate.filters import SEVEN, second_derivative, zero_phase

Array = NDArray[np.float64]

DT = 0.002
UNSURE = 0.1
INNER = slice(400, -400)
"""Samples that no end of a filter reaches."""


def swinging(amplitude: float, offset: float, gap: float, compliance: float, frequency: float) -> Shaken:
    """A motor moved by hand: a sinusoid around an offset, the load by the law of the contact."""
    time = np.arange(4000) * DT
    angle = offset + amplitude * np.sin(2 * math.pi * frequency * time)
    load = (angle - np.clip(angle, -gap / 2, gap / 2)) / compliance
    return Shaken(above_band(angle, DT), np.full(len(time), amplitude), load, UNSURE, DT)


def missed(shaken: Shaken, gap: float, compliance: float) -> float:
    """Rms of what the sizes miss of the motion, over the motion's."""
    left = (shaken.moved - twist_in_flight(shaken, gap, compliance))[INNER]
    return float(np.sqrt(np.mean(left**2) / np.mean(shaken.moved[INNER] ** 2)))


@given(
    amplitude=st.floats(2e-4, 2e-3),
    compliance=st.floats(2e-5, 2e-4),
    frequency=st.floats(60.0, 90.0),
    offset=st.floats(-1e-3, 1e-3),
)
@settings(max_examples=25, deadline=None)
def test_without_play_the_motion_is_load_times_compliance(
    amplitude: float, compliance: float, frequency: float, offset: float
) -> None:
    shaken = swinging(amplitude, offset, 0.0, compliance, frequency)
    assert missed(shaken, 0.0, compliance) < 0.03
    assert 0.4 < missed(shaken, 0.0, compliance / 2) < 0.55


@given(
    gap=st.floats(3e-4, 5e-3),
    swing=st.floats(1.2, 3.0),
    offset=st.floats(-0.3, 0.3),
    compliance=st.floats(3e-5, 1e-4),
    frequency=st.floats(62.0, 85.0),
)
@settings(max_examples=40, deadline=None)
def test_true_sizes_explain_a_motor_that_flies_from_flank_to_flank(
    gap: float, swing: float, offset: float, compliance: float, frequency: float
) -> None:
    amplitude = swing * gap / 2
    shaken = swinging(amplitude, offset * amplitude, gap, compliance, frequency)
    assert missed(shaken, gap, compliance) < 0.035


@given(
    gap=st.floats(1.5e-3, 5e-3),
    swing=st.floats(0.2, 0.8),
    beyond=st.floats(-0.3, 1.0),
    compliance=st.floats(3e-5, 1e-4),
    frequency=st.floats(62.0, 85.0),
)
@settings(max_examples=40, deadline=None)
def test_true_sizes_explain_a_motor_that_bounces_on_one_flank(
    gap: float, swing: float, beyond: float, compliance: float, frequency: float
) -> None:
    amplitude = swing * gap / 2
    shaken = swinging(amplitude, gap / 2 + beyond * amplitude, gap, compliance, frequency)
    assert missed(shaken, gap, compliance) < 0.025


def test_on_one_flank_a_wider_play_is_the_same_and_elsewhere_it_is_not() -> None:
    gap, compliance = 2e-3, 5e-5
    on_one = swinging(4e-4, 1.2e-3, gap, compliance, 75.0)
    across = swinging(1.3e-3, 1e-4, gap, compliance, 75.0)
    assert missed(on_one, 5 * gap, compliance) == pytest.approx(missed(on_one, gap, compliance), abs=1e-3)
    assert missed(across, gap, compliance) < 0.05
    assert missed(across, 0.7 * gap, compliance) > 0.2


def test_a_motor_afloat_without_load_says_nothing_of_its_flanks() -> None:
    afloat = swinging(4e-4, 0.0, 2e-3, 5e-5, 75.0)
    assert not afloat.load.any()
    assert missed(afloat, 2e-3, 5e-5) < 0.02
    assert missed(afloat, 5e-4, 5e-5) > 0.5


def shaking(time: Array) -> Array:
    """Torque on a motor [Nm] that throws it about."""
    return np.asarray(14 * np.sin(2 * math.pi * 62 * time) * (1 + 0.3 * np.sin(2 * time)) + 6 * np.sin(1.5 * time))


def measured(angle: Array, torque: Array, inertia: float) -> Shaken:
    """A motor as its signals show it; its load by Newton's law."""
    smooth, pushed = (zero_phase(values, 1000.0, DT) for values in (angle, torque))
    moved = above_band(smooth, DT)
    swing = np.sqrt(2 * np.maximum(zero_phase(moved**2, 40.0, DT), 0.0))
    return Shaken(moved, swing, pushed - inertia * second_derivative(smooth, DT, SEVEN), UNSURE, DT)


@pytest.mark.parametrize(("gap", "within"), [(4e-4, 0.06), (8e-4, 0.06), (2e-3, 0.1)])
def test_play_and_flanks_of_a_motor_thrown_to_and_fro_are_told(
    loose_motor: Callable[..., Any], gap: float, within: float
) -> None:
    """The filter of the signals takes 5 to 7 % of such a swing, and of a wide play that much; flanks damp it, too."""
    compliance, inertia = 5.5e-5, 0.06
    motor = loose_motor(gap, compliance, inertia, damping=0.1)
    shaken = measured(*motor.thrown(shaking, 16.0), inertia)

    def left(sizes: Array) -> Array:
        found = shaken.moved - twist_in_flight(shaken, 1e-3 * sizes[0], 1e-5 * sizes[1])
        return np.asarray(1e3 * zero_phase(found * shaken.moved / shaken.swing, 40.0, DT)[INNER])

    found = least_squares(left, [1e3 * gap / 1.5, 4.0]).x
    assert found[0] == pytest.approx(1e3 * gap, rel=within)
    assert found[1] == pytest.approx(1e5 * compliance, rel=0.06)
    bare = 1e3 * zero_phase(shaken.moved**2 / shaken.swing, 40.0, DT)[INNER]
    assert np.std(left(found)) < 0.04 * np.sqrt(np.mean(bare**2))

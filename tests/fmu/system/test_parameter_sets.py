"""Sets of parameters: the vehicle as identified, at the ends of intervals, with and without what a diagnosis found."""

from __future__ import annotations

import numpy as np
import pytest

from fmu.system.parameter_sets import NORMAL_95, Knowledge, ParameterSet, corners, effect_ends, model_set
from ident.effects import make_effect
from ident.effects.extended import ExtendedModel
from ident.vehicle.description import load_vehicle
from ident.vehicle.parameters import PARAMETER_NAMES, Parameters, parameter_column

FLOOR = 0.8


@pytest.fixture
def base() -> ParameterSet:
    return model_set("run", "as identified", ExtendedModel(load_vehicle().prior), (), FLOOR)


def knowledge(share: float, correlation: dict[tuple[str, str], float]) -> Knowledge:
    """Standard deviations as a share of the values, and correlations of some pairs."""
    values, matrix = load_vehicle().prior.values, np.eye(len(PARAMETER_NAMES))
    for (one, other), value in correlation.items():
        matrix[parameter_column(one), parameter_column(other)] = value
        matrix[parameter_column(other), parameter_column(one)] = value
    std = share * values
    return Knowledge(values - NORMAL_95 * std, values + NORMAL_95 * std, std, matrix)


def test_a_corner_is_the_end_of_an_interval_and_takes_along_what_correlates(base: ParameterSet) -> None:
    known = knowledge(0.01, {("C_l", "d_vl"): -0.8})
    found = {one.name: one.values for one in corners(base, known)}
    assert len(found) == 2 * len(PARAMETER_NAMES)
    high, values = found["corner_C_l_high"], base.values
    assert high["C_l"] / values["C_l"] == pytest.approx(1 + 0.01 * NORMAL_95)
    assert high["d_vl"] / values["d_vl"] == pytest.approx(1 - 0.8 * 0.01 * NORMAL_95)
    assert high["m_ch"] == values["m_ch"]
    assert found["corner_d_vl_low"]["C_l"] > values["C_l"]


def test_every_corner_touches_the_ellipsoid_of_equal_likelihood(base: ParameterSet) -> None:
    """No vehicle of a corner is less likely than the interval says: its distance is NORMAL_95 standard deviations."""
    generator = np.random.default_rng(3)
    factors = generator.normal(size=(11, 14))
    covariance = factors @ factors.T
    scale = np.sqrt(np.diag(covariance))
    known = knowledge(0.002, {})
    known = Knowledge(known.low, known.high, known.std, covariance / np.outer(scale, scale))
    spread = known.correlation * np.outer(known.std, known.std)
    centre = np.array([base.values[name] for name in PARAMETER_NAMES])
    for corner in corners(base, known):
        away = np.array([corner.values[name] for name in PARAMETER_NAMES]) - centre
        assert np.sqrt(away @ np.linalg.solve(spread, away)) == pytest.approx(NORMAL_95, rel=1e-6)


def test_friction_ends_at_zero_and_a_vehicle_of_no_mass_is_left_out(base: ParameterSet) -> None:
    found = {one.name: one.values for one in corners(base, knowledge(0.6, {}))}
    assert found["corner_d_vl_low"]["d_vl"] == 0.0
    assert "corner_m_ch_low" not in found
    assert "corner_m_ch_high" in found


def test_what_is_known_exactly_has_no_corners(base: ParameterSet) -> None:
    assert list(corners(base, knowledge(0.0, {}))) == []


def test_the_vehicle_without_what_was_diagnosed_has_it_at_size_zero() -> None:
    """`slip` has the friction of the floor in place of zero."""
    prior = load_vehicle().prior
    stribeck = make_effect("stribeck", "steering_left", {"amplitude": 6.0, "velocity": 0.3})
    slip = make_effect("slip", "wheel_fl", {"friction": 0.2})
    plain = model_set("run", "as identified", ExtendedModel(prior), (stribeck, slip), FLOOR).values
    found = model_set("diagnosed", "with effects", ExtendedModel(prior, (stribeck, slip)), (), FLOOR).values
    assert plain.keys() == found.keys()
    assert (plain["stribeck.steering_left.amplitude"], found["stribeck.steering_left.amplitude"]) == (0.0, 6.0)
    assert (plain["friction_limit_fl"], found["friction_limit_fl"]) == (FLOOR, 0.2)


def test_an_effect_ends_where_its_interval_does_but_not_on_the_other_side_of_zero() -> None:
    sure = make_effect("stribeck", "steering_left", {"amplitude": 6.0, "velocity": 0.3}, {"amplitude": 0.5})
    doubtful = make_effect("stribeck", "steering_right", {"amplitude": 1.0, "velocity": 0.3}, {"amplitude": 0.7})
    exact = make_effect("quadratic_drag", "chassis", {"coefficient": 2.0})
    model = ExtendedModel(Parameters(load_vehicle().prior.values, np.zeros(11)), (sure, doubtful, exact))
    base = model_set("diagnosed", "with effects", model, (), FLOOR)
    found = {one.name: one.values for one in effect_ends(base, model)}
    assert sorted(found) == [
        "effect_stribeck_steering_left_high",
        "effect_stribeck_steering_left_low",
        "effect_stribeck_steering_right_high",
    ]
    low = found["effect_stribeck_steering_left_low"]["stribeck.steering_left.amplitude"]
    assert low == pytest.approx(6.0 - NORMAL_95 * 0.5)

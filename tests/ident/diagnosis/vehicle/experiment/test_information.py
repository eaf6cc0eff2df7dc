"""What an experiment is expected to tell, against closed forms and against what physics says of it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import integrate

from ident.diagnosis.vehicle.experiment.information import NOTHING, Imagined, expected_information
from ident.diagnosis.vehicle.experiment.visibility import Visibility
from ident.vehicle.description import load_vehicle

VISIBILITY = Visibility(load_vehicle())

shares = st.lists(st.floats(0.01, 1.0), min_size=2, max_size=5).map(lambda found: np.array(found) / np.sum(found))


def entropy(probabilities: np.ndarray) -> float:
    return float(-probabilities @ np.log2(probabilities))


@given(shares)
def test_what_cannot_be_told_apart_tells_nothing_and_what_can_tells_all(probabilities: np.ndarray) -> None:
    count = len(probabilities)
    assert expected_information(probabilities, np.zeros((count, count))) == pytest.approx(0.0, abs=1e-9)
    far = 1e6 * (1 - np.eye(count))
    assert expected_information(probabilities, far) == pytest.approx(entropy(probabilities))


@given(st.floats(0.1, 8.0), st.floats(0.05, 0.95))
def test_it_is_no_more_than_the_mutual_information_of_two_gaussians_and_not_much_less_than_half_of_it(
    distance: float, probability: float
) -> None:
    """By quadrature; of means that nearly coincide it is half."""
    weights = np.array([probability, 1 - probability])

    def density(y: float) -> np.ndarray:
        return np.exp(-0.5 * (y - np.array([0.0, distance])) ** 2) / np.sqrt(2 * np.pi)

    def integrand(y: float) -> float:
        each = density(y)
        mixed = float(weights @ each)
        return float(np.sum(weights * each * np.log2(np.maximum(each, 1e-300) / max(mixed, 1e-300))))

    exact = integrate.quad(integrand, -12, distance + 12, limit=200)[0]
    separations = distance**2 * (1 - np.eye(2))
    found = expected_information(weights, separations)
    assert found <= exact + 1e-6
    assert found >= 0.49 * exact - 1e-6


def told(experiment: str, key: str, values: list[float], other: str) -> float:
    """Bits of one, as likely as another that is as like it in the four steps as it can be."""
    names = frozenset(one.partition("@")[0] for one in (key, other) if one != NOTHING)
    four, further = VISIBILITY.imagined(experiment, names)
    assert further is not None
    parameters = np.append(VISIBILITY.vehicle.prior.values, np.zeros(len(four.names) - 11))
    imagined = Imagined(four, further, parameters)
    mean = imagined.found(key, np.array(values))
    return imagined.information({key: 0.5, other: 0.5}, {key: mean, other: imagined.like(mean, other)})


def test_a_slope_is_told_from_a_friction_that_is_larger_ahead_by_turning_round_or_in_the_air() -> None:
    slope, friction = ("slope@chassis", [0.01, 0.0]), "asymmetric_coulomb@wheels"
    assert told("two headings", *slope, friction) == pytest.approx(1.0, abs=0.01)
    assert told("wheels lifted", *slope, friction) == pytest.approx(1.0, abs=0.01)
    assert told("lateral", *slope, friction) == pytest.approx(0.0, abs=0.01)


def test_wheels_of_a_side_are_told_apart_in_the_air_alone() -> None:
    drag = ("quadratic_drag@wheel_fl", [0.05])
    assert told("wheels lifted", *drag, "quadratic_drag@wheel_rl") == pytest.approx(1.0, abs=0.01)
    assert told("torque dither", *drag, "quadratic_drag@wheel_rl") == pytest.approx(0.0, abs=0.01)


def test_a_bias_of_a_motor_is_nowhere_told_from_asymmetric_friction_of_its_wheel() -> None:
    for experiment in ("two headings", "wheels lifted", "known payload"):
        assert told(experiment, "torque_bias@drive_fl", [0.3], "asymmetric_coulomb@wheel_fl") < 0.01


def test_a_smaller_effect_is_told_less() -> None:
    large, small = (told("torque dither", "torque_gain@drive_fl", [gain], NOTHING) for gain in (0.05, 0.002))
    assert 0 <= small < large


@pytest.mark.parametrize(
    ("key", "values"),
    [
        ("elasticity@drive_fl", [3e-4]),
        ("time_delay@drive_fl", [0.01]),
        ("torque_filter@drive_fl", [0.01]),
        ("stribeck@steering_left", [3.0, 0.3]),
    ],
)
def test_a_cause_whose_columns_are_not_all_of_it_is_not_told_from_itself(key: str, values: list[float]) -> None:
    """No experiment tells more than what is not known: a bit, of two that are as likely."""
    for experiment in ("wheels lifted", "torque dither", "several speeds"):
        assert told(experiment, key, values, NOTHING) <= 1 + 1e-9

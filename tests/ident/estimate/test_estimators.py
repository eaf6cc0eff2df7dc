"""Estimators are interchangeable: each recovers the truth, and says rightly how sure it is."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.errors import EstimationError
from ident.estimate.identify import identify
from ident.estimate.least_squares import Estimator, LeastSquares, LinearSystem, WeightedLeastSquares
from ident.estimate.result import KnownInertia
from ident.records.record import Record
from ident.vehicle.description import VehicleDescription
from ident.vehicle.parameters import Parameters

Array = NDArray[np.float64]

ESTIMATORS = (LeastSquares(), WeightedLeastSquares())
TRUTH = np.array([3.0, -1.0])
SIZES = (0.02, 2.0)
"""Noise of two parts."""

every_estimator = pytest.mark.parametrize("estimator", ESTIMATORS, ids=lambda one: one.name)


def system(generator: np.random.Generator, noise: tuple[float, float] = SIZES) -> LinearSystem:
    x = generator.normal(size=(2, 400, 2))
    y = x @ TRUTH + np.array(noise)[:, None] * generator.normal(size=(2, 400))
    return LinearSystem(("a", "b"), x.reshape(-1, 2), y.ravel(), np.repeat([0, 1], 400))


@every_estimator
def test_without_noise_the_truth_is_found(estimator: Estimator) -> None:
    found = estimator(system(np.random.default_rng(0), (0.0, 0.0)))
    np.testing.assert_allclose(found.values, TRUTH, rtol=1e-9)


@every_estimator
def test_errors_of_the_rows_move_the_values_by_their_influence(estimator: Estimator) -> None:
    given = system(np.random.default_rng(1))
    found = estimator(given)
    errors = given.torque - given.regressor @ TRUTH
    np.testing.assert_allclose(found.values - TRUTH, found.influence.T @ errors, rtol=1e-9)
    np.testing.assert_allclose(found.residual, given.torque - given.regressor @ found.values)


def test_weights_pay_where_parts_are_of_different_noise() -> None:
    generator = np.random.default_rng(2)
    errors = {estimator.name: [] for estimator in ESTIMATORS}
    for _ in range(50):
        given = system(generator)
        for estimator in ESTIMATORS:
            errors[estimator.name].append(estimator(given).values - TRUTH)
    plain, weighted = (float(np.std(errors[estimator.name])) for estimator in ESTIMATORS)
    assert weighted < 0.05 * plain, "the loud part tells a hundredth of what the other does"


@every_estimator
def test_what_is_not_excited_is_named(estimator: Estimator) -> None:
    given = system(np.random.default_rng(3))
    blind = LinearSystem(given.names, given.regressor * [1.0, 0.0], given.torque, given.part)
    with pytest.raises(EstimationError, match="excites b"):
        estimator(blind)


@every_estimator
def test_a_campaign_is_identified_by_each(
    estimator: Estimator, record_of: Callable[..., Record], vehicle: VehicleDescription, truth: Parameters
) -> None:
    inertia = KnownInertia(truth["B_w"], 0.0, "truth")
    found = identify(record_of(vehicle, truth), vehicle.geometry, known_inertia=inertia, estimator=estimator)
    np.testing.assert_allclose(found.values, truth.values, rtol=1e-3)
    assert {estimate.method for estimate in found.estimates[:-1]} == {estimator.name}

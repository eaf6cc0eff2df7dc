from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ident.errors import EstimationError
from ident.estimate.least_squares import LinearSystem, solve

NAMES = ("p", "q", "s")
property_of = settings(max_examples=40, deadline=None, derandomize=True)
scale = st.floats(-6, 6).map(lambda power: 10.0**power)


def problem(seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    generator = np.random.default_rng(seed)
    return generator.normal(size=(50, 3)), generator.normal(size=50)


@property_of
@given(seed=st.integers(0, 1000), scales=st.tuples(scale, scale, scale))
def test_the_solution_does_not_depend_on_the_units_of_the_parameters(
    seed: int, scales: tuple[float, float, float]
) -> None:
    x, y = problem(seed)
    plain = solve(LinearSystem(NAMES, x, y))
    scaled = solve(LinearSystem(NAMES, x * scales, y))
    np.testing.assert_allclose(scaled.values * scales, plain.values, rtol=1e-8, atol=1e-12)
    np.testing.assert_allclose(scaled.residual, plain.residual, atol=1e-9)
    assert scaled.condition == pytest.approx(plain.condition, rel=1e-8)


def test_the_solution_is_that_of_the_normal_equations() -> None:
    x, y = problem()
    solution = solve(LinearSystem(NAMES, x, y))
    np.testing.assert_allclose(x.T @ (y - x @ solution.values), 0.0, atol=1e-12)
    np.testing.assert_allclose(solution.normal_inverse, np.linalg.inv(x.T @ x))
    np.testing.assert_allclose(solution.residual, y - x @ solution.values)


def test_the_condition_number_is_that_of_the_correlation_of_the_columns() -> None:
    x, y = problem()
    gram = x.T @ x
    norms = np.sqrt(np.diag(gram))
    values = np.linalg.eigvalsh(gram / np.outer(norms, norms))
    assert solve(LinearSystem(NAMES, x, y)).condition == pytest.approx(values[-1] / values[0])


def test_two_columns_at_an_angle_have_the_condition_of_that_angle() -> None:
    """Unit columns at 60 degrees: eigenvalues 1 + cos and 1 - cos, ratio 3."""
    x = np.array([[1.0, 0.5], [0.0, np.sqrt(0.75)], [0.0, 0.0]])
    assert solve(LinearSystem(("p", "q"), x * [1.0, 1000.0], np.ones(3))).condition == pytest.approx(3.0)


def test_parameters_without_any_excitation_are_named() -> None:
    x, y = problem()
    x[:, 1] = 0.0
    with pytest.raises(EstimationError, match=r"excites q\.") as caught:
        solve(LinearSystem(NAMES, x, y))
    assert "step" in caught.value.remedy


def test_parameters_that_nothing_tells_apart_are_named_and_others_not() -> None:
    x, y = problem()
    x[:, 2] = -3.0 * x[:, 0]
    with pytest.raises(EstimationError, match="tell p from s") as caught:
        solve(LinearSystem(NAMES, x, y))
    assert "q" not in caught.value.what.split("(")[0].removeprefix("The excitation does not tell")
    assert "accelerations" in caught.value.remedy

"""CasADi functions over many samples."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ident.plant.vectorised import Vectorised

SAMPLES = 7


def table() -> Vectorised:
    """(x, p) -> (3, 5), with entries that are always zero, and parts that several columns share."""
    x, p = ca.SX.sym("x", 4), ca.SX.sym("p", 2)
    shared = ca.sin(x[0] * x[1]) + p[0]
    columns = [
        ca.vertcat(shared, 0, x[2]),
        ca.vertcat(0, 0, 0),
        ca.vertcat(shared**2, ca.tanh(x[3] / p[1]), shared * x[2]),
        ca.vertcat(1.5, 0, ca.sqrt(shared**2 + 1)),
        ca.vertcat(x[1], x[1] - x[2], p[0] * p[1]),
    ]
    return Vectorised(ca.Function("table", [x, p], [ca.cse(ca.sparsify(ca.horzcat(*columns)))]))


@given(st.lists(st.integers(0, 4), unique=True, min_size=1))
def test_some_columns_of_a_function_are_those_of_the_whole_in_any_order(columns: list[int]) -> None:
    generator = np.random.default_rng(3)
    arguments = generator.normal(size=(SAMPLES, 4)), np.array([0.3, 2.0])
    whole = table()
    np.testing.assert_array_equal(whole.only(columns)(*arguments), whole(*arguments)[..., columns])


@pytest.mark.parametrize(("columns", "inputs"), [([1], set()), ([0], {(0, 0), (0, 1), (0, 2), (1, 0)})])
def test_what_a_column_does_not_need_is_not_computed(columns: list[int], inputs: set[tuple[int, int]]) -> None:
    whole, part = table(), table().only(columns)
    assert part.inputs == inputs
    assert len(part.program) < len(whole.program)

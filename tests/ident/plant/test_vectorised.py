"""CasADi functions over many samples."""

from __future__ import annotations

import casadi as ca
import numpy as np
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


def test_what_a_column_does_not_need_is_not_computed() -> None:
    """The last column has neither the sine nor the hyperbolic tangent of the others."""
    whole, part = table(), table().only([4])
    assert part.inputs == {(0, 1), (0, 2), (1, 0), (1, 1)}
    assert {ca.OP_SIN, ca.OP_TANH} <= {code for code, *_ in whole.program}
    assert {code for code, *_ in part.program} == {ca.OP_INPUT, ca.OP_SUB, ca.OP_MUL, ca.OP_OUTPUT}


def test_a_place_that_is_used_again_asks_for_nothing_of_what_stood_there() -> None:
    """CasADi puts later values where earlier ones are no longer needed."""
    x = ca.SX.sym("x", 2)
    whole = Vectorised(ca.Function("f", [x], [ca.horzcat(ca.exp(ca.sin(x[0])), ca.sqrt(ca.cos(x[1])))]))
    targets = [targets[0] for code, _, targets, _ in whole.program if code != ca.OP_OUTPUT]
    assert len(set(targets)) < len(targets)
    assert {code for code, *_ in whole.only([1]).program} == {ca.OP_INPUT, ca.OP_COS, ca.OP_SQRT, ca.OP_OUTPUT}

"""A function of which only the last argument changes has the values of the whole one."""

from __future__ import annotations

import casadi as ca
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from ident.plant.prepared import Prepared
from ident.plant.vectorised import CHUNK, Vectorised

SAMPLES = CHUNK + 7


def function() -> Vectorised:
    z, p, values = ca.SX.sym("z", 3), ca.SX.sym("p", 2), ca.SX.sym("values", 2)
    speed = ca.sin(z[0]) * p[0] + z[1] ** 2
    added = values[0] * ca.tanh(speed / (1 + values[1] ** 2))
    outputs = ca.vertcat(speed + added, ca.exp(-z[2]) * p[1], ca.if_else(z[0] > values[1], speed, added) + z[2])
    return Vectorised(ca.Function("f", [z, p, values], [ca.cse(outputs)]))


WHOLE = function()
FIXED = np.random.default_rng(3).normal(size=(SAMPLES, 3)), np.array([0.7, -1.3])
NUMBERS = st.floats(-3, 3, allow_subnormal=False)


@given(first=NUMBERS, second=NUMBERS)
def test_it_has_the_values_of_the_whole_function(first: float, second: float) -> None:
    last, prepared = np.array([first, second]), Prepared(WHOLE, *FIXED)
    np.testing.assert_array_equal(prepared.entries(last), WHOLE.entries(*FIXED, last)[list(prepared.touched)])


def test_one_call_leaves_nothing_behind_for_the_next() -> None:
    prepared, lasts = Prepared(WHOLE, *FIXED), [np.array([0.5, 1.0]), np.array([-2.0, 0.1]), np.array([0.5, 1.0])]
    first, other, again = map(prepared.entries, lasts)
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)


def test_only_what_the_last_argument_has_a_part_in_is_touched() -> None:
    assert Prepared(WHOLE, *FIXED).touched == (0, 2)

"""Equations as C say what they say as expressions, and what effects of size zero add takes no part."""

from __future__ import annotations

import ctypes
import math
import shutil
import subprocess
from collections.abc import Callable, Collection
from importlib import resources
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from numpy.typing import NDArray

from fmu.model.elimination import elimination
from fmu.model.straight_code import HEADERS, Routine, c_function
from fmu.table import neutral_effects
from fmu.variables import Block, Carried

Array = NDArray[np.float64]
Call = Callable[..., Array]

X, P = ca.SX.sym("x", 3), ca.SX.sym("p", 3)
SIZES = (0, 1)
WRITTEN = Path(str(resources.files("fmu.model")))


@pytest.fixture
def compiled(tmp_path: Path) -> Callable[..., Call]:
    """Gives a function (x, p) -> y of an expression y, by way of C."""

    def build(result: ca.SX, sizes: Collection[int]) -> Call:
        included = "".join(f"#include {header}\n" for header in HEADERS)
        text = included + c_function(Routine("f", {"x": X, "p": P}, {"y": result}), sizes)
        source, library = tmp_path / f"{len(sizes)}.c", tmp_path / f"{len(sizes)}.so"
        source.write_text(text, encoding="utf-8")
        strict = ["-std=c89", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-Wno-unused-function", "-ffp-contract=off"]
        made = ["-I", WRITTEN, "-O1", "-shared", "-fPIC", "-o", library, source, "-lm"]
        subprocess.run([shutil.which("gcc") or "cc", *strict, *made], check=True)
        function = ctypes.CDLL(str(library)).qo_eq_f

        def call(x: Array, p: Array) -> Array:
            y = np.full(result.numel(), math.pi)
            function(*(np.ascontiguousarray(values).ctypes.data_as(ctypes.c_void_p) for values in (x, p, y)))
            return y

        return call

    return build


EVERYTHING = ca.vertcat(
    X[0] + X[1] - X[2] * -X[0] / (2 + X[1] ** 2),
    ca.sqrt(ca.fabs(X[0])) + ca.sin(X[1]) * ca.cos(X[2]) - ca.tan(X[0] / 3) + ca.exp(-X[1]) + ca.log(1 + X[2] ** 2),
    ca.tanh(X[0]) + ca.atan(X[1]) + ca.atan2(X[1], X[2]) + ca.sign(X[2]) + ca.fmax(X[0], X[1]) * ca.fmin(X[1], X[2]),
    ca.if_else(X[0] < X[1], X[2] ** 3, X[0] ** 0.5 * P[2]) + (X[0] <= X[2]) + (X[0] == X[1]) + (X[0] != X[1]),
    ca.floor(3 * X[1])
    + ca.asin(ca.tanh(X[0]))
    + ca.acos(ca.tanh(X[1]))
    + ca.logic_and(X[0] > 0, X[1] > 0)
    + ca.logic_not(X[2] > 0),
    P[0] * ca.exp(X[0]) / X[1] + P[1] * X[2] * ca.sin(X[0]) + P[2] / X[1] + P[0] / X[1],
    ca.sin(P[0] * X[1]) * ca.exp(X[2]) + (P[0] + P[1] * X[0]) ** 2 * ca.cos(X[2]) - 2 * P[1],
    3.5,
    X[1],
)


@pytest.mark.parametrize("p", [(0.0, 0.0, 1.3), (0.7, 0.0, 1.3), (0.0, -0.4, 1.3), (0.7, -0.4, -1.3)])
def test_c_says_what_the_expressions_say(compiled: Callable[..., Call], p: tuple[float, ...]) -> None:
    wanted, given = ca.Function("wanted", [X, P], [EVERYTHING]), compiled(EVERYTHING, SIZES)
    signs = np.tile(((1, 1, 1), (1, -1, 1), (1, 1, -1), (1, -1, -1)), (5, 1))
    for x in signs * np.random.default_rng(1).uniform(0.1, 2.0, (20, 3)):
        np.testing.assert_allclose(given(x, np.array(p)), np.asarray(wanted(x, p))[:, 0], rtol=1e-12, atol=1e-14)


def test_tanh_is_that_of_the_c_library_to_a_few_units_in_the_last_place(compiled: Callable[..., Call]) -> None:
    """Over thirty decades and across 0.4, where its two forms meet; what is no number stays none."""
    given = compiled(ca.tanh(X), ())
    sizes = np.concatenate([10.0 ** np.linspace(-30.0, 2.0, 400), np.linspace(0.39, 0.41, 200), [0.0, 20.0, 1e300]])
    for x in (*sizes, *-sizes):
        np.testing.assert_allclose(given(np.full(3, x), np.zeros(3)), np.tanh(x), rtol=8e-16, atol=0.0)
    np.testing.assert_array_equal(given(np.array([np.inf, -np.inf, np.nan]), np.zeros(3)), [1.0, -1.0, np.nan])


@pytest.mark.parametrize("p", [(0.0, 0.0, 1.3), (0.7, 0.0, 1.3), (0.0, -0.4, 1.3)])
def test_what_is_left_out_changes_no_bit(compiled: Callable[..., Call], p: tuple[float, ...]) -> None:
    with_tests, without = compiled(EVERYTHING, SIZES), compiled(EVERYTHING, ())
    for x in np.random.default_rng(2).uniform(0.1, 2.0, (20, 3)):
        np.testing.assert_array_equal(with_tests(x, np.array(p)), without(x, np.array(p)))


def test_an_effect_of_size_zero_is_not_computed(compiled: Callable[..., Call]) -> None:
    """Seen by a law that is no number here: zero times it would be none either."""
    law = ca.log(X[1]) * ca.exp(X[0])
    given = compiled(ca.vertcat(X[0] + P[0] * law, ca.sin(P[0] * law) + X[2]), SIZES)
    x = np.array([1.0, -1.0, 0.5])
    np.testing.assert_array_equal(given(x, np.array([0.0, 1.0, 1.0])), [1.0, 0.5])
    assert np.isnan(given(x, np.array([1e-9, 1.0, 1.0]))).all()


def test_what_one_effect_needs_is_computed_though_another_is_not_there(compiled: Callable[..., Call]) -> None:
    shared = ca.exp(X[0])
    given = compiled(ca.vertcat(P[0] * shared * ca.sin(X[1]) + P[1] * shared, P[0] * P[1] * shared), SIZES)
    x = np.array([0.3, 0.2, 0.0])
    np.testing.assert_allclose(given(x, np.array([0.0, 2.0, 0.0])), [2 * math.exp(0.3), 0.0], rtol=1e-15)
    np.testing.assert_allclose(
        given(x, np.array([2.0, 0.0, 0.0])), [2 * math.exp(0.3) * math.sin(0.2), 0.0], rtol=1e-15
    )


def test_a_divisor_of_several_is_inverted_once() -> None:
    text = c_function(Routine("f", {"x": X, "p": P}, {"y": ca.vertcat(X[0] / X[2], X[1] / X[2], 1 / X[2])}), ())
    assert text.count("/") == 1


@pytest.mark.parametrize("shift", [0.5, 1e3, 1e9])
def test_elimination_solves_the_whole_system(shift: float) -> None:
    """Rates of two bodies with a few states that hang on them, in pairs and alone."""
    generator, count, coupled = np.random.default_rng(3), 12, 3
    filled = generator.random((count, count)) < 0.2
    filled[:coupled, :coupled] = True
    entries = np.where(filled, generator.normal(0.0, 10.0, (count, count)), 0.0)
    x = ca.SX.sym("x", count)
    found = elimination(ca.jacobian(ca.DM(ca.sparsify(entries)) @ (x * x), x), coupled)
    jacobian = ca.Function("jacobian", [x], [ca.jacobian(ca.DM(ca.sparsify(entries)) @ (x * x), x)])(ca.DM.ones(count))
    right = generator.normal(size=count)
    factorized = ca.Function("factorize", [found.jacobian, found.shift], [found.factors, found.matrix])
    factors, matrix = factorized(jacobian.nonzeros(), shift)
    reduced = np.asarray(ca.Function("eliminate", [found.held, found.right], [found.reduced])(factors, right))[:, 0]
    rest = np.linalg.solve(np.asarray(matrix).reshape(coupled, coupled), reduced[:coupled])
    solved = np.concatenate([rest, reduced[coupled:]])
    solution = np.asarray(ca.Function("expand", [found.held, found.solved], [found.solution])(factors, solved))[:, 0]
    expected = np.linalg.solve(shift * np.eye(count) - np.asarray(jacobian), right)
    np.testing.assert_allclose(solution, expected, rtol=1e-9)


def internal_steps(core: Any, cycles: int) -> float:
    """Mean of a communication step of 2 ms, torques jumping by up to 0.1 Nm each time."""
    generator, instance, count = np.random.default_rng(4), core.new(), 0
    for _ in range(cycles):
        instance.u[:4] = 0.1 * generator.uniform(-1.0, 1.0, 4)
        left = 2e-3
        while left > 1e-15:
            left -= instance.advance(left)
            count += 1
    return count / cycles


def test_states_of_effects_that_are_not_there_ask_for_no_short_steps(core_of: Callable[..., Any]) -> None:
    """A spring that is as stiff as it gets swings at 400 Hz and more, a delay of no time settles within 0.1 ms."""
    plain, carrying = (internal_steps(core_of("prototype", neutral_effects(kind)), 300) for kind in Carried)
    assert carrying < 2.5 * plain


def test_they_ask_for_them_as_soon_as_one_is_there(core_of: Callable[..., Any]) -> None:
    core = core_of("prototype", neutral_effects(Carried.ALL))
    late = core.new()
    late.set(**{f"time_delay.drive_{wheel}.delay": 1e-3 for wheel in ("fl", "rl", "fr", "rr")})
    lengths = []
    for instance in (core.new(), late):
        instance.step(0.01)
        instance.u[:4] = 0.5
        lengths.append(instance.advance(2e-3))
    assert lengths[1] < lengths[0] / 2
    assert late["slope_torque_fl"] != 0.0
    assert len(late.x) == len(core.table.block(Block.STATE))

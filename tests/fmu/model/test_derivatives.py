"""Directional and adjoint derivatives are exact, in every mode and between the modes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fmu.table import neutral_effects
from fmu.variables import Block, Inputs

Array = NDArray[np.float64]


@pytest.fixture(scope="session", params=list(Inputs))
def core(core_of: Callable[..., Any], request: pytest.FixtureRequest) -> Any:
    return core_of("prototype", neutral_effects(), request.param)


@pytest.fixture
def moving(core: Any, posture: Array) -> Any:
    """A vehicle in motion with every effect that there is, friction holding and wheels slipping."""
    generator = np.random.default_rng(2)
    instance = core.new(gamma=0.4)
    instance.x[:15] = generator.normal(size=15) * np.array([0.1] * 3 + [0.02] * 2 + [0.05] * 4 + [0.5] * 6)
    instance.set(alpha_l=posture[0], alpha_r=posture[1], creep_stiffness=1e3)
    instance.u[:] = [*generator.normal(size=4), 0.03, -0.02, 40.0]
    for row in core.table.block(Block.PARAMETER):
        if "." in row.name and row.start == 0.0:
            instance.set_parameter(row.name, generator.uniform(0.01, 0.03))
    return instance


def everything(instance: Any) -> Array:
    return np.concatenate([instance.derivatives(), instance.outputs()])


def central_difference(instance: Any, block: Block, direction: Array, size: float) -> Array:
    """Fourth order."""
    values = {}
    for step in (-2, -1, 1, 2):
        moved = instance.copy()
        moved.blocks[block][:] += step * size * direction
        values[step] = everything(moved)
    return (values[-2] - values[2] + 8 * (values[1] - values[-1])) / (12 * size)


def seeded(instance: Any, block: Block, direction: Array) -> Array:
    seeds = [
        direction if each is block else np.zeros(instance.core.sizes[each])
        for each in (Block.STATE, Block.INPUT, Block.PARAMETER)
    ]
    return instance.jacobian_vector(*seeds)


@pytest.mark.parametrize("block", [Block.STATE, Block.INPUT, Block.PARAMETER])
def test_directional_derivatives_agree_with_finite_differences_to_a_millionth(moving: Any, block: Block) -> None:
    for index, row in enumerate(moving.core.table.block(block)):
        direction = np.zeros(moving.core.sizes[block])
        direction[index] = 1.0
        exact = seeded(moving, block, direction)
        # Between truncation of long steps and rounding of short ones each result has a step that suits it.
        sizes = max(abs(moving.blocks[block][index]), 1e-2) * 10.0 ** np.arange(-1.0, -8.5, -0.5)
        estimates = np.array([central_difference(moving, block, direction, size) for size in sizes])
        error = np.abs(estimates - exact).min(axis=0)
        # What cancels inside, contacts and stops, is up to a thousand times what is left.
        rounding = 1e-12 * np.abs(everything(moving)).max() / sizes[3]
        bound = 1e-6 * np.maximum(np.abs(exact), 1e-3 * np.abs(exact).max()) + rounding
        assert (error <= bound).all(), (row.name, error / bound)


def test_adjoint_derivatives_are_the_transpose_of_directional_ones(moving: Any) -> None:
    sizes = [moving.core.sizes[block] for block in (Block.STATE, Block.INPUT, Block.PARAMETER)]
    generator = np.random.default_rng(9)
    for _ in range(20):
        seeds = [generator.normal(size=size) for size in sizes]
        weights = generator.normal(size=sizes[0]), generator.normal(size=moving.core.sizes[Block.OUTPUT])
        forward = moving.jacobian_vector(*seeds)
        backward = moving.vector_jacobian(*weights)
        expected = np.concatenate(weights) @ forward
        scale = np.abs(np.concatenate(weights)) @ np.abs(forward)
        assert np.concatenate(seeds) @ backward == pytest.approx(expected, abs=1e-12 * scale)


def test_what_does_not_depend_has_no_derivative(moving: Any) -> None:
    core = moving.core
    knowns = [row.name for block in (Block.STATE, Block.INPUT) for row in core.table.block(block)]
    unknowns = [row.name for block in (Block.DERIVATIVE, Block.OUTPUT) for row in core.table.block(block)]
    for name in knowns:
        row = core.table[name]
        direction = np.zeros(core.sizes[row.block])
        direction[row.index] = 1.0
        influence = seeded(moving, row.block, direction)
        for unknown, value in zip(unknowns, influence, strict=True):
            assert value == 0.0 or name in core.generated.dependencies[unknown]

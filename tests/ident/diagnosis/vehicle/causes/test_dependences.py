"""Columns of a function of the motion are those of the effects that are such functions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.diagnosis.names import EffectName
from ident.diagnosis.problem import Channel, Problem
from ident.diagnosis.vehicle.build import build_problem
from ident.diagnosis.vehicle.experiment.ideal import FOUR, ideal_record
from ident.vehicle.description import VehicleDescription

Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def problem(prototype: VehicleDescription) -> Problem:
    named = (
        EffectName.QUADRATIC_DRAG,
        EffectName.ASYMMETRIC_VISCOUS,
        EffectName.WHEEL_RADIUS,
        EffectName.WHEEL_ECCENTRICITY,
    )
    return build_problem([ideal_record(FOUR, prototype)], prototype, prototype.prior, effects=named)


@pytest.mark.parametrize("where", ["chassis", "wheels", "wheel_rl"])
def test_a_square_of_the_rate_is_a_quadratic_drag(problem: Problem, where: str) -> None:
    _same(problem, f"law_rate@{where}", f"quadratic_drag@{where}", lambda x: x * np.abs(x))


@pytest.mark.parametrize("where", ["steering_left", "steering", "wheel_fr"])
def test_a_rate_without_its_sign_is_an_asymmetric_friction(problem: Problem, where: str) -> None:
    _same(problem, f"law_rate@{where}", f"asymmetric_viscous@{where}", np.abs)


@pytest.mark.parametrize("where", ["wheel_fl", "wheel_rr"])
def test_a_radius_that_depends_on_nothing_is_another_radius(problem: Problem, where: str) -> None:
    _same(problem, f"law_rate_rolling@{where}", f"wheel_radius@{where}", np.ones_like, Channel.KINEMATIC)


def test_a_radius_over_the_angle_of_its_wheel_is_an_eccentric_wheel(problem: Problem) -> None:
    _same(problem, "law_angle_wheel_rolling@wheel_fr", "wheel_eccentricity@wheel_fr", np.cos, Channel.KINEMATIC)


def _same(
    problem: Problem, law: str, name: str, function: Callable[[Array], Array], channel: Channel = Channel.DYNAMIC
) -> None:
    """Columns alike up to one factor in every block of a channel, where the vehicle moves; the law has no others."""
    (dependence,) = (one for one in problem.dependences if one.key == law)
    made = dependence.design(lambda x: function(x)[..., None])
    assert all(one is None for block, one in zip(problem.blocks, made, strict=True) if block.channel is not channel)
    named = [
        column if block.channel is channel else None
        for block, column in zip(problem.blocks, problem.candidate(name).variants[0].columns, strict=True)
    ]
    pairs = [
        (block.moving, one, other)
        for block, one, other in zip(problem.blocks, made, named, strict=True)
        if one is not None
    ]
    assert pairs
    assert all(other is not None for _, _, other in pairs)
    mine = np.concatenate([one[moving, 0] for moving, one, _ in pairs])
    theirs = np.concatenate([other[moving, 0] for moving, _, other in pairs if other is not None])
    factor = float(mine @ theirs) / float(mine @ mine)
    assert np.abs(theirs - factor * mine).max() < 0.02 * np.abs(theirs).max()
    assert all(other is None for one, other in zip(made, named, strict=True) if one is None)

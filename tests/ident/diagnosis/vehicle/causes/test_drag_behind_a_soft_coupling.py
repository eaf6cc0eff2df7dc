"""The wheel behind a soft coupling stands askew by what that gives way, and drags by the grip times that angle.

Driven in MuJoCo without noise, whose contacts slide with all their grip from 10⁻⁵ m/s on; half of what the wheel slides
aside by, the one across from it does.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

pytest.importorskip("mujoco", reason="mujoco is not installed: pip install mujoco")

from hil.exam.plans import plan_exam
from hil.exam.worlds import EmulatedWorld
from hil.network import load_network
from ident.diagnosis.names import EffectName
from ident.diagnosis.observations.linear import rms
from ident.diagnosis.problem import Problem
from ident.diagnosis.vehicle.build import build_problem
from ident.effects import make_effect
from ident.vehicle.description import VehicleDescription
from ident.vehicle.parameters import PARAMETER_NAMES
from ident.vehicle.quantities import GRAVITY

Array = NDArray[np.float64]

COMPLIANCE = 7.5e-5
"""[rad/Nm]."""

WORLD = EmulatedWorld("prototype", "mujoco", "--engine mujoco")


@pytest.fixture(scope="module")
def problem(prototype: VehicleDescription) -> Problem:
    plan = plan_exam(prototype, 7, load_network(WORLD.network_file).cycle_period).fit
    effect = make_effect(EffectName.ELASTICITY, "steering_left", {"compliance": COMPLIANCE})
    record = WORLD.drive_quietly(replace(plan, periods=1), [effect])
    return build_problem([record], prototype, WORLD.truth(), effects=[EffectName.ELASTICITY])


def parts(problem: Problem, coordinate: str) -> tuple[Array, Array, Array]:
    """Of a force that drives: what the true parameters leave, what unit drag adds, and unit creep."""
    (number,) = (index for index, block in enumerate(problem.blocks) if block.coordinate == coordinate)
    block = problem.blocks[number]
    contribution = problem.candidate("elasticity@steering_left").contribution
    assert contribution is not None
    values = np.append(WORLD.truth().values, np.zeros(len(problem.names) - len(PARAMETER_NAMES)))
    # The angle alone shows in the rolling rows, not in those of the forces.
    assert contribution(np.array([COMPLIANCE]), values)[number] is None
    drag = contribution(np.array([COMPLIANCE, 1.0]), values)[number]
    assert drag is not None
    rest = block.target - block.baseline @ values
    return rest[block.moving], drag[block.moving], block.baseline[block.moving, len(PARAMETER_NAMES) :]


def by_the_grip(vehicle: VehicleDescription) -> float:
    """Friction of the wheel over the torque that the coupling passes on [-]."""
    load = WORLD.truth()["m_ch"] * GRAVITY / 4
    return WORLD.emulated().prototype.floor_friction * load * vehicle.geometry.wheel_radius * COMPLIANCE


@pytest.mark.parametrize("coordinate", ["x", "gamma"])
def test_the_drag_is_the_grip_of_a_wheel_times_the_angle_by_which_it_stands_askew(
    problem: Problem, prototype: VehicleDescription, coordinate: str
) -> None:
    rest, drag, creep = parts(problem, coordinate)
    columns = np.column_stack([drag, creep])
    scale = np.linalg.norm(columns, axis=0).clip(min=1e-12)
    found = np.linalg.lstsq(columns / scale, rest, rcond=None)[0][0] / scale[0]
    assert found == pytest.approx(by_the_grip(prototype), rel=0.25)


@pytest.mark.parametrize("coordinate", ["x", "gamma"])
def test_it_is_most_of_the_force_that_a_soft_coupling_takes(
    problem: Problem, prototype: VehicleDescription, coordinate: str
) -> None:
    rest, drag, _ = parts(problem, coordinate)
    assert rms(rest) > 2 * rms(rest - by_the_grip(prototype) * drag)

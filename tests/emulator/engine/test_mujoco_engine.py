"""What is MuJoCo's own: its state, and tyres of the stiffness that the file says."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import pytest

from emulator.as_built import AsBuilt
from emulator.prototype import load_prototype
from ident.vehicle.quantities import GRAVITY

pytest.importorskip("mujoco", reason="mujoco is not installed: pip install mujoco")

from emulator.engine.mujoco.engine import MuJoCoEngine

STEP = 1e-3


PATCH = 3.0
"""Torque with which a patch resists turning [Nm]."""


def built(name: str, patch_torque: float = 0.0) -> AsBuilt:
    plain = AsBuilt.of(load_prototype(name))
    return replace(plain, wheels=tuple(replace(wheel, patch_torque=patch_torque) for wheel in plain.wheels))


@pytest.fixture(params=[("prototype", 0.0), ("prototype", PATCH), ("compact", 0.0)], ids=str)
def engine(request: pytest.FixtureRequest) -> Iterator[MuJoCoEngine]:
    engine = MuJoCoEngine(built(*request.param), step_size=STEP, gui=False)
    run(engine, [0.0] * 8, 0.5)
    yield engine
    engine.close()


def run(engine: MuJoCoEngine, torques: list[float], duration: float) -> None:
    for _ in range(round(duration / STEP)):
        engine.step(torques)


def test_what_was_saved_goes_on_bit_by_bit(engine: MuJoCoEngine) -> None:
    """Friction changed and one wheel on wet ground before; other torques in between."""

    def drive() -> tuple[list[float], list[float], tuple[tuple[float, ...], ...]]:
        for index in range(300):
            engine.step([0.0] * 4 + [20.0 * math.sin(0.03 * index), 12.0, -9.0, 15.0])
        return engine.angles(), engine.rates(), engine.base_pose()

    engine.set_friction([2 * torque for torque in engine.coulomb])
    engine.set_ground(2, 0.05)
    run(engine, [0.0] * 4 + [14.0, 9.0, -7.0, 16.0], 0.3)
    saved = engine.save()
    first = drive()
    engine.set_friction(engine.coulomb)
    engine.set_ground(2, None)
    run(engine, [0.0] * 4 + [-5.0, 9.0, 8.0, 3.0], 0.1)
    engine.restore(saved)
    assert drive() == first


def test_a_load_presses_the_tyres_by_its_weight_over_their_stiffness(engine: MuJoCoEngine) -> None:
    tyre = engine._prototype.tyre.stiffness
    height = engine.base_pose()[0][2]
    engine.model.opt.gravity[2] *= 1.5
    run(engine, [0.0] * 8, 1.0)
    more = 0.5 * engine._prototype.truth["m_ch"] * GRAVITY / 4
    assert height - engine.base_pose()[0][2] == pytest.approx(more / tyre, rel=1e-6)


def test_the_solver_converges_before_it_runs_out_of_iterations(engine: MuJoCoEngine) -> None:
    worst = 0
    for index in range(2000):
        engine.step([0.0] * 4 + [25.0 * math.sin(0.01 * index), 12.0, -9.0, 15.0])
        worst = max(worst, int(engine.data.solver_niter[0]))
    assert worst < engine.model.opt.iterations / 2


@pytest.mark.parametrize("share", [0.95, 1.05])
def test_a_patch_holds_what_it_can_and_does_not_creep(share: float) -> None:
    """Two units of a side that are turned, front against rear, by nearly the resistance of their patches, or more."""
    engine = MuJoCoEngine(built("prototype", PATCH), step_size=STEP, gui=False)
    engine.set_friction([0.0] * 8)
    run(engine, [share * PATCH, -share * PATCH] + [0.0] * 6, 0.3)
    rate = abs(engine.rates()[0])
    engine.close()
    assert rate < 1e-9 if share < 1 else rate > 0.1

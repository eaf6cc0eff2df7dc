"""What is PyBullet's own: settings that docs/emulator.md and the speeds are quoted for."""

from __future__ import annotations

import numpy as np
import pytest

from emulator.as_built import AsBuilt
from emulator.engine.choice import ENGINES
from emulator.prototype import load_prototype
from emulator.vehicle import EmulatedVehicle
from ident.extras import EngineName
from ident.vehicle.quantities import GRAVITY

pybullet = pytest.importorskip("pybullet", reason="pybullet is not installed: pip install pybullet")

STEP = 1e-3


def test_the_solver_sweeps_as_often_as_the_speed_is_quoted_for() -> None:
    from emulator.engine.pybullet.engine import DEFAULT_SOLVER, PyBulletEngine

    engine = PyBulletEngine(AsBuilt.of(load_prototype()), step_size=STEP, gui=False)
    parameters = pybullet.getPhysicsEngineParameters(engine.client)
    assert parameters["numSolverIterations"] == DEFAULT_SOLVER.iterations == 50
    assert parameters["fixedTimeStep"] == STEP
    assert np.isclose(parameters["gravityAccelerationZ"], -GRAVITY)
    engine.close()


def test_closing_twice_is_harmless_and_releases_the_world() -> None:
    vehicle = EmulatedVehicle(load_prototype(), seed=0, make_engine=ENGINES[EngineName.PYBULLET])
    client = vehicle.engine.client
    vehicle.close()
    vehicle.close()
    assert not pybullet.isConnected(client)

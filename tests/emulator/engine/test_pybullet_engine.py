"""What is PyBullet's own: settings that docs/emulator.md and the speeds are quoted for."""

from __future__ import annotations

import numpy as np
import pytest

from emulator.as_built import AsBuilt
from emulator.engine.choice import ENGINES
from emulator.engine.protocol import Engine
from emulator.prototype import load_prototype
from emulator.vehicle import EmulatedVehicle
from hil.exam.quiet import drive_quietly
from ident.campaign.plan import assemble_plan
from ident.extras import EngineName
from ident.plant import kinematics
from ident.vehicle.description import load_vehicle
from ident.vehicle.quantities import GRAVITY

pybullet = pytest.importorskip("pybullet", reason="pybullet is not installed: pip install pybullet")

STEP = 1e-3


def test_the_solver_sweeps_as_often_as_the_speed_is_quoted_for() -> None:
    from emulator.engine.pybullet.engine import DEFAULT_SOLVER, PyBulletEngine

    engine = PyBulletEngine(AsBuilt.of(load_prototype()), step_size=STEP, gui=False)
    parameters = pybullet.getPhysicsEngineParameters(engine.client)
    assert parameters["numSolverIterations"] == DEFAULT_SOLVER.iterations == 100
    assert parameters["fixedTimeStep"] == STEP
    assert np.isclose(parameters["gravityAccelerationZ"], -GRAVITY)
    engine.close()


def test_closing_twice_is_harmless_and_releases_the_world() -> None:
    vehicle = EmulatedVehicle(load_prototype(), seed=0, make_engine=ENGINES[EngineName.PYBULLET])
    client = vehicle.engine.client
    vehicle.close()
    vehicle.close()
    assert not pybullet.isConnected(client)


class WatchedVehicle(EmulatedVehicle):
    """A vehicle of which everything that the floor sees is written down after every cycle."""

    def __init__(self, name: str) -> None:
        super().__init__(load_prototype(name), seed=0, noise_scale=0.0, make_engine=ENGINES[EngineName.PYBULLET])
        self.seen: list[np.ndarray] = []

    def advance(self, duration: float) -> None:
        super().advance(duration)
        self.seen.append(_seen_of(self.engine))


def _seen_of(engine: Engine) -> np.ndarray:
    forces = np.array(engine.floor_forces())
    return np.concatenate([engine.twist(), engine.mean_rates(), engine.angles(), forces[:, 0], forces[:, 1]])


@pytest.mark.parametrize("name", ["prototype", "compact"])
def test_wheels_that_have_grip_to_spare_roll_while_they_are_steered_through_straight_ahead(name: str) -> None:
    """Steering and rolling of four wheels hang together then, and the solver must have the sweeps to say so.

    With 50 sweeps a quarter of the grip let them slide by 0.6 to 0.8 mm in a metre.
    """
    vehicle, built, described = WatchedVehicle(name), load_prototype(name), load_vehicle(name)
    drive_quietly(assemble_plan(described, {}, steps=["lane_change"], periods=4, cycle=2 * STEP), vehicle, built)
    twist, rates, angles, load, friction = np.split(np.array(vehicle.seen), [3, 11, 19, 23], axis=1)
    vehicle.close()
    moved = np.hstack([twist, rates[:, [0, 2]], rates[:, 4:]])
    constraints = kinematics.constraint_matrix(angles[:, [0, 2]], described.geometry)
    slid = np.einsum("nij,nj->ni", constraints, moved)[:, 4:]
    rolled = np.abs(described.geometry.wheel_radius * rates[:, 4:])
    held = (friction < 0.25 * built.floor_friction * load) & (rolled > 0.5)
    assert held.mean() > 0.1
    assert np.sqrt(np.mean((slid[held] / rolled[held]) ** 2)) < 2e-4

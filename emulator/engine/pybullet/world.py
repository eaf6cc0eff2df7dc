"""What is in PyBullet's world: the floor, the vehicle, its surfaces, the coupling of its steering."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import pybullet

from emulator.as_built import AsBuilt
from emulator.prototype import Prototype
from ident.vehicle.quantities import GRAVITY


@dataclass(frozen=True)
class SolverSettings:
    """Settings of the engine's constraint solver; the defaults are the ones measured in docs/emulator.md.

    Attributes:
        iterations: sweeps of the solver a step.
        coupling_erp: share of the front/rear coupling error that a step takes back [-].
        coupling_force: largest torque in that coupling [Nm].
        residual_threshold: the solver stops early below it; 0 does all sweeps.
    """

    iterations: int = Prototype.solver_sweeps
    coupling_erp: float = 0.2
    coupling_force: float = 1e5
    residual_threshold: float = 0.0


DEFAULT_SOLVER: Final = SolverSettings()


def prepare_world(client: int, built: AsBuilt, step_size: float, settings: SolverSettings) -> None:
    """Empty the world of a client, and lay the floor.

    Args:
        client: PyBullet's id of the world.
        built: gives gravity and the floor's friction.
        step_size: [s].
        settings: of the solver.
    """
    pybullet.resetSimulation(physicsClientId=client)
    pybullet.setGravity(*built.gravity, physicsClientId=client)
    pybullet.setPhysicsEngineParameter(
        fixedTimeStep=step_size,
        numSolverIterations=settings.iterations,
        solverResidualThreshold=settings.residual_threshold,
        deterministicOverlappingPairs=1,
        physicsClientId=client,
    )
    plane = pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=client)
    floor = pybullet.createMultiBody(baseMass=0, baseCollisionShapeIndex=plane, physicsClientId=client)
    # The engine multiplies the coefficients of the two surfaces; the wheels have 1.
    pybullet.changeDynamics(
        floor,
        -1,
        lateralFriction=built.prototype.floor_friction,
        spinningFriction=0.0,
        rollingFriction=0.0,
        restitution=0.0,
        physicsClientId=client,
    )


def load_vehicle(client: int, urdf: str, height: float, *, fixed: bool) -> int:
    """PyBullet's id of the vehicle of a URDF text, with its base at a height [m], held there or free."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "vehicle.urdf"
        path.write_text(urdf, encoding="utf-8")
        return int(
            pybullet.loadURDF(
                str(path),
                basePosition=[0.0, 0.0, height],
                useFixedBase=fixed,
                flags=pybullet.URDF_USE_INERTIA_FROM_FILE,
                physicsClientId=client,
            )
        )


def set_surfaces(client: int, body: int, wheels: Sequence[int], built: AsBuilt) -> None:
    """Make the bodies free of damping and the tyres radially elastic.

    On rigid wheels the four loads are indeterminate: the solver then puts most of the weight on one
    diagonal, and the wheels of the other slip at moderate acceleration.

    Args:
        client, body: PyBullet's ids of world and vehicle.
        wheels: (4,) PyBullet's indices of the rolling joints, fl, rl, fr, rr.
        built: gives tyres, grip and the turning resistance of their patches.
    """
    prototype = built.prototype
    quarter_mass, tyre = prototype.truth["m_ch"] / 4, prototype.tyre
    for wheel in wheels:
        pybullet.changeDynamics(
            body,
            wheel,
            contactStiffness=tyre.stiffness,
            contactDamping=2 * tyre.damping_ratio * math.sqrt(tyre.stiffness * quarter_mass),
            physicsClientId=client,
        )
    for link in range(-1, pybullet.getNumJoints(body, client)):
        pybullet.changeDynamics(
            body,
            link,
            lateralFriction=1.0,
            spinningFriction=0.0,
            rollingFriction=0.0,
            restitution=0.0,
            linearDamping=0.0,
            angularDamping=0.0,
            jointDamping=0.0,
            physicsClientId=client,
        )
    grip_of_weight = quarter_mass * GRAVITY * prototype.floor_friction
    for joint, build in zip(wheels, built.wheels, strict=True):
        pybullet.changeDynamics(
            body,
            joint,
            lateralFriction=build.grip,
            spinningFriction=build.patch_torque / grip_of_weight,
            physicsClientId=client,
        )


def couple(client: int, body: int, front: int, rear: int, settings: SolverSettings) -> None:
    """Couple the steering of two units of a side, joints `front` and `rear`: the rear turns against the front."""
    constraint = pybullet.createConstraint(
        body,
        front,
        body,
        rear,
        pybullet.JOINT_GEAR,
        [0.0, 0.0, 1.0],
        [0.0, 0.0, 0.0],
        [0.0, 0.0, 0.0],
        physicsClientId=client,
    )
    pybullet.changeConstraint(
        constraint,
        gearRatio=1.0,
        erp=settings.coupling_erp,
        maxForce=settings.coupling_force,
        physicsClientId=client,
    )

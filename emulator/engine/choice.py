"""The engines by name; only the one that is chosen is imported."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from emulator.as_built import AsBuilt
from emulator.engine.protocol import Engine, MakeEngine
from ident.extras import EngineName


def _pybullet(built: AsBuilt, *, step_size: float, gui: bool) -> Engine:
    from emulator.engine.pybullet.engine import PyBulletEngine, SolverSettings

    settings = SolverSettings(iterations=built.prototype.solver_sweeps)
    return PyBulletEngine(built, step_size=step_size, gui=gui, settings=settings)


def _mujoco(built: AsBuilt, *, step_size: float, gui: bool) -> Engine:
    from emulator.engine.mujoco.engine import MuJoCoEngine

    return MuJoCoEngine(built, step_size=step_size, gui=gui)


ENGINES: Final[Mapping[EngineName, MakeEngine]] = {EngineName.PYBULLET: _pybullet, EngineName.MUJOCO: _mujoco}
"""What makes each."""

"""The engines by name; only the one that is chosen is imported."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from emulator.as_built import AsBuilt
from emulator.engine.protocol import Engine, MakeEngine, MakePainter, Painter
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


def _pybullet_painter(built: AsBuilt, *, width: int, height: int) -> Painter:
    from emulator.engine.pybullet.painter import PyBulletPainter

    return PyBulletPainter(built, width=width, height=height)


def _mujoco_painter(built: AsBuilt, *, width: int, height: int) -> Painter:
    from emulator.engine.mujoco.painter import MuJoCoPainter

    return MuJoCoPainter(built, width=width, height=height)


PAINTERS: Final[Mapping[EngineName, MakePainter]] = {
    EngineName.PYBULLET: _pybullet_painter,
    EngineName.MUJOCO: _mujoco_painter,
}
"""What draws each engine's vehicle, by that engine's renderer."""

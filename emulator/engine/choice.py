"""The engines by name; only the one that is chosen is imported."""

from __future__ import annotations

import enum

from emulator.as_built import AsBuilt
from emulator.engine.protocol import Engine, MakeEngine


class EngineName(enum.StrEnum):
    """Names of the engines on the command line and in files."""

    PYBULLET = "pybullet"


def _pybullet(built: AsBuilt, *, step_size: float, gui: bool) -> Engine:
    from emulator.engine.pybullet.engine import PyBulletEngine, SolverSettings

    settings = SolverSettings(iterations=built.prototype.solver_sweeps)
    return PyBulletEngine(built, step_size=step_size, gui=gui, settings=settings)


ENGINES: dict[EngineName, MakeEngine] = {EngineName.PYBULLET: _pybullet}
"""What makes each."""

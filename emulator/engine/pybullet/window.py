"""The window in which the engine shows the vehicle."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping

import pybullet

from ident.errors import UserError


def open_window() -> int:
    """PyBullet's id of a physics world with a window.

    Raises:
        UserError: there is no display.
    """
    require_display(os.environ)
    client = int(pybullet.connect(pybullet.GUI))
    pybullet.configureDebugVisualizer(pybullet.COV_ENABLE_GUI, 0, physicsClientId=client)
    pybullet.resetDebugVisualizerCamera(3.0, 40.0, -35.0, [0.0, 0.0, 0.0], physicsClientId=client)
    return client


def require_display(environment: Mapping[str, str]) -> None:
    """Refuse a window where the environment names no display; the engine would end the whole process.

    Raises:
        UserError: Linux without DISPLAY.
    """
    if sys.platform == "linux" and not environment.get("DISPLAY"):
        raise UserError(
            "There is no display to show the vehicle on.", "Run without --gui, or set DISPLAY to an X server."
        )

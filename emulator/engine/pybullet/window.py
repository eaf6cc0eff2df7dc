"""The window in which the engine shows the vehicle."""

from __future__ import annotations

import os

import pybullet

from emulator.engine.display import require_display


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

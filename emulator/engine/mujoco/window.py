"""The window in which the engine shows the vehicle."""

from __future__ import annotations

import os
from typing import Any

import mujoco.viewer

from emulator.engine.display import require_display


def open_window(model: Any, data: Any) -> Any:
    """MuJoCo's passive viewer of a model.

    Raises:
        UserError: there is no display.
    """
    require_display(os.environ)
    return mujoco.viewer.launch_passive(model, data, show_left_ui=False, show_right_ui=False)

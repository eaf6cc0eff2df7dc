"""Pictures of the vehicle by MuJoCo's renderer."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from emulator.as_built import AsBuilt
from emulator.engine.camera import Camera
from emulator.engine.mujoco.engine import by_unit
from emulator.engine.mujoco.mjcf import generate_mjcf
from emulator.engine.mujoco.offscreen import open_context

_STEP = 1e-3
"""Of a model that takes none [s]."""
_SHAPES = 200
"""Most that a picture has."""


class MuJoCoPainter:
    """An `emulator.engine.protocol.Painter`: a model of its own that takes no step, put where the vehicle is.

    Not `mujoco.Renderer`: it draws by what MUJOCO_GL said when mujoco was loaded, and with a variable unset that is a
    window system.

    Raises:
        UserError: there is no OpenGL to draw with.
    """

    def __init__(self, built: AsBuilt, *, width: int, height: int) -> None:
        self._model: Any = mujoco.MjModel.from_xml_string(generate_mjcf(built, step_size=_STEP, on_stand=False))
        self._data: Any = mujoco.MjData(self._model)
        self._opengl, self._context = open_context(os.environ, self._model, width, height)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._context)
        self._scene: Any = mujoco.MjvScene(self._model, maxgeom=_SHAPES)
        self._option: Any = mujoco.MjvOption()
        self._frame = mujoco.MjrRect(0, 0, width, height)
        self._pixels = np.empty((height, width, 3), np.uint8)

    def paint(
        self, position: Sequence[float], orientation: Sequence[float], angles: Sequence[float], camera: Camera
    ) -> NDArray[np.uint8]:
        """A picture (height, width, 3), red, green, blue."""
        x, y, z, w = orientation
        self._data.qpos[:] = (*position, w, x, y, z, *by_unit(angles))
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_comPos(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)
        self._opengl.make_current()
        mujoco.mjv_updateScene(
            self._model,
            self._data,
            self._option,
            None,
            _camera(camera),
            mujoco.mjtCatBit.mjCAT_ALL.value,
            self._scene,
        )
        mujoco.mjr_render(self._frame, self._scene, self._context)
        mujoco.mjr_readPixels(self._pixels, None, self._frame, self._context)
        # OpenGL counts rows from below.
        return self._pixels[::-1].copy()

    def close(self) -> None:
        """Release OpenGL."""
        if self._opengl is not None:
            self._opengl.make_current()
            self._context.free()
            self._opengl.free()
            self._opengl = None


def _camera(camera: Camera) -> Any:
    free = mujoco.MjvCamera()
    free.lookat[:] = camera.target
    free.distance = camera.distance
    free.azimuth, free.elevation = math.degrees(camera.azimuth), math.degrees(camera.elevation)
    return free

"""Pictures of the vehicle by PyBullet's software renderer: no display, no graphics card."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
import pybullet
from numpy.typing import NDArray

from emulator.as_built import AsBuilt
from emulator.engine.camera import VIEW_ANGLE, Camera, heading
from emulator.engine.floor import draw_floor
from emulator.engine.layout import JOINTS
from emulator.engine.pybullet.urdf import generate_urdf

_NEAR, _FAR = 0.1, 50.0
_LIGHT: Final = (-0.4, 0.5, 1.6)
"""Where the light comes from."""
_NOTHING: Final = -1
"""What the segmentation has where there is no body."""


class PyBulletPainter:
    """An `emulator.engine.protocol.Painter`: a world of its own that nothing moves in, with a vehicle that is put where
    the one to be drawn is.
    """

    def __init__(self, built: AsBuilt, *, width: int, height: int) -> None:
        self._prototype = built.prototype
        self._width, self._height = width, height
        self._client = int(pybullet.connect(pybullet.DIRECT))
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "vehicle.urdf"
            path.write_text(generate_urdf(built), encoding="utf-8")
            self._body = int(
                pybullet.loadURDF(str(path), flags=pybullet.URDF_USE_INERTIA_FROM_FILE, physicsClientId=self._client)
            )
        count = pybullet.getNumJoints(self._body, self._client)
        infos = (pybullet.getJointInfo(self._body, index, self._client) for index in range(count))
        by_name = {info[1].decode(): info[0] for info in infos}
        self._joints = [by_name[name] for name in JOINTS]
        self._projection = pybullet.computeProjectionMatrixFOV(VIEW_ANGLE, width / height, _NEAR, _FAR)

    def paint(
        self, position: Sequence[float], orientation: Sequence[float], angles: Sequence[float], camera: Camera
    ) -> NDArray[np.uint8]:
        """A picture (height, width, 3), red, green, blue."""
        self._put(position, orientation, angles)
        view = pybullet.computeViewMatrix(camera.eye, camera.target, (0.0, 0.0, 1.0))
        _, _, colours, _, bodies = pybullet.getCameraImage(
            self._width,
            self._height,
            view,
            self._projection,
            lightDirection=_LIGHT,
            shadow=0,
            renderer=pybullet.ER_TINY_RENDERER,
            physicsClientId=self._client,
        )
        size = (self._height, self._width)
        # Of a frame of 50 the renderer would spend two thirds on the floor; and its edges are jagged.
        pose = (position[0], position[1], heading(orientation))
        floor = draw_floor(camera, self._width, self._height, self._prototype, pose)
        seen = np.asarray(colours, np.uint8).reshape(*size, 4)[..., :3]
        return np.where(np.asarray(bodies).reshape(*size, 1) == _NOTHING, floor, seen)

    def close(self) -> None:
        """Disconnect from this world."""
        if pybullet.isConnected(self._client):
            pybullet.disconnect(self._client)

    def _put(self, position: Sequence[float], orientation: Sequence[float], angles: Sequence[float]) -> None:
        # PyBullet places a body by its centre of mass.
        mass, turned = pybullet.multiplyTransforms(
            position, orientation, self._prototype.rigid_bodies.chassis.centre, (0.0, 0.0, 0.0, 1.0)
        )
        pybullet.resetBasePositionAndOrientation(self._body, mass, turned, physicsClientId=self._client)
        for joint, angle in zip(self._joints, angles, strict=True):
            pybullet.resetJointState(self._body, joint, angle, 0.0, physicsClientId=self._client)

"""The vehicle in three dimensions: body, wheels, steering, path, forces."""

from __future__ import annotations

import math
from collections import deque
from typing import Final

import numpy as np
import viser
from numpy.typing import NDArray

from emulator.engine.camera import VIEW_ANGLE, Camera
from emulator.engine.camera import heading as camera_heading
from emulator.engine.looks import Kind, Shape
from hil.page.shown import Health, Pose, Sketch, Snapshot, Vector
from ident.vehicle.geometry import WHEELS

NORMAL_COLOUR: Final = (40, 110, 200)
DRIVE_COLOUR: Final = (230, 110, 10)
_GROUND_COLOUR: Final = (170, 170, 170)
_SKY_INTENSITY: Final = 1.6
_PATH_COLOUR: Final = (30, 140, 90)
COLOURS: Final = {
    Health.RUNNING: "#2b8a3e",
    Health.IDLE: "#868e96",
    Health.CHANGING: "#e67700",
    Health.BROKEN: "#c92a2a",
}

_LONGEST_PATH: Final = 1500
"""Points of the path that are kept."""

_SPACING: Final = 0.05
"""Between two points of the path [m]."""

_JUMP: Final = 1.0
"""Further than this between two looks it was not driven: it was put there [m]."""

_WEIGHT_ARROW: Final = 0.3
"""Length of the arrow of a quarter of the weight, over wheelbase and track width."""

_FORCES_APART: Final = 3.0
"""The arrows of drive forces are drawn so much longer than those of normal forces, which are larger."""

_AZIMUTH, _ELEVATION, _DISTANCE = math.radians(-38.0), math.radians(-36.0), 2.3


def _wxyz(orientation: tuple[float, ...]) -> tuple[float, float, float, float]:
    x, y, z, w = orientation
    return w, x, y, z


def _about_z(angle: float) -> tuple[float, float, float, float]:
    return math.cos(angle / 2), 0.0, 0.0, math.sin(angle / 2)


def _about_y(angle: float) -> tuple[float, float, float, float]:
    return math.cos(angle / 2), 0.0, math.sin(angle / 2), 0.0


_UP: Final = np.array((0.0, 0.0, 1.0))
_LYING: Final = (math.cos(math.pi / 4), math.sin(math.pi / 4), 0.0, 0.0)
"""Turns the z axis of a cylinder into y."""


class Scene:
    """The vehicle on its floor.

    With `following` the floor moves and the vehicle stays where it is: so the camera belongs to who looks, always.

    Args:
        server: to draw on.
        sketch: the vehicle.

    Attributes:
        following: the vehicle stays in the middle.
    """

    def __init__(self, server: viser.ViserServer, sketch: Sketch) -> None:
        self.following = True
        self._sketch = sketch
        self._scene = scene = server.scene
        scene.set_up_direction("+z")
        # Light from a panorama and shadows take a browser without a graphics card twice as long as all the rest.
        scene.configure_environment_map(None)
        scene.configure_default_lights(cast_shadow=False)
        scene.add_light_hemisphere("/sky", ground_color=_GROUND_COLOUR, intensity=_SKY_INTENSITY)
        self._world = scene.add_frame("/world", show_axes=False)
        scene.add_grid(
            "/world/floor",
            infinite_grid=True,
            cell_size=0.5,
            section_size=5.0,
            fade_distance=40.0,
            cell_color=(206, 210, 214),
            section_color=(150, 156, 162),
        )
        scene.add_frame("/world/origin", axes_length=0.3, axes_radius=0.008)
        self._vehicle = scene.add_frame("/vehicle", show_axes=False)
        for number, shape in enumerate(sketch.chassis):
            self._solid(f"/vehicle/body_{number}", shape)
        self._knuckles, self._wheels, self._labels = [], [], []
        for name, wheel, (drive, node) in zip(WHEELS, sketch.wheels, sketch.drives, strict=True):
            at = f"/vehicle/steering_{name}"
            self._knuckles.append(scene.add_frame(at, show_axes=False, position=wheel.corner))
            self._wheels.append(scene.add_frame(f"{at}/wheel", show_axes=False, position=wheel.axle))
            for number, shape in enumerate(wheel.knuckle):
                self._solid(f"{at}/post_{number}", shape)
            for number, shape in enumerate(wheel.wheel):
                self._solid(f"{at}/wheel/part_{number}", shape)
            above = (wheel.axle[0], wheel.axle[1], 2.6 * wheel.radius)
            self._labels.append(
                scene.add_label(f"{at}/name", f"{drive} ({node})", position=above, anchor="bottom-center")
            )
        idle = np.zeros((len(WHEELS), 2, 3))
        size = sketch.size / 100
        self._normal, self._drive = (
            scene.add_arrows(
                f"/forces/{name}",
                idle,
                colour,
                shaft_radius=0.4 * size,
                head_radius=0.9 * size,
                head_length=2.0 * size,
            )
            for name, colour in (("normal", NORMAL_COLOUR), ("drive", DRIVE_COLOUR))
        )
        self._path: deque[tuple[float, float, float]] = deque(maxlen=_LONGEST_PATH)
        self._line = scene.add_line_segments(
            "/world/path", np.zeros((1, 2, 3)), _PATH_COLOUR, thickness=0.02, thickness_units="world"
        )
        self._path_changed = False
        self._look_from_behind(server)

    @property
    def force_scales(self) -> tuple[float, float]:
        """What an arrow of one metre stands for: normal force, drive force [N]."""
        normal = self._sketch.weight / len(WHEELS) / (_WEIGHT_ARROW * self._sketch.size)
        return normal, normal / _FORCES_APART

    def draw(self, snapshot: Snapshot) -> None:
        """Put everything where it is."""
        pose = snapshot.pose
        x, y, z = pose.position
        away = (-x, -y, 0.0) if self.following else (0.0, 0.0, 0.0)
        self._world.position = away
        self._vehicle.position = (x + away[0], y + away[1], z)
        self._vehicle.wxyz = _wxyz(pose.orientation)
        for index, (knuckle, wheel) in enumerate(zip(self._knuckles, self._wheels, strict=True)):
            knuckle.wxyz = _about_z(pose.angles[index])
            wheel.wxyz = _about_y(pose.angles[len(WHEELS) + index])
        self._draw_forces(pose, np.array(away))
        self._remember((x, y, 0.01))

    def draw_path(self) -> None:
        """Draw the path as far as it is known."""
        if self._path_changed:
            points = np.array(self._path)
            pairs = np.stack([points[:-1], points[1:]], axis=1)
            driven = np.linalg.norm(pairs[:, 1] - pairs[:, 0], axis=1) < _JUMP
            if driven.any():
                self._line.points = pairs[driven].astype(np.float32)
            self._path_changed = False

    def forget_path(self) -> None:
        """Begin a path anew."""
        self._path.clear()
        self._line.points = np.zeros((1, 2, 3), dtype=np.float32)

    def label(self, snapshot: Snapshot) -> None:
        """Say at every wheel how its drive is."""
        for handle, (name, node), drive in zip(self._labels, self._sketch.drives, snapshot.drives, strict=True):
            broken = f" {drive.error_code:04X}h" if drive.error_code else ""
            state = drive.state if drive.nmt not in ("no supply", "bus-off") else drive.nmt
            text = f"{name} ({node}) {state}{broken}"
            if handle.text != text:
                handle.text = text

    def _draw_forces(self, pose: Pose, away: NDArray[np.float64]) -> None:
        normal_scale, drive_scale = self.force_scales
        heading = camera_heading(pose.orientation)
        normal, drive = [], []
        for index, wheel in enumerate(self._sketch.wheels):
            steered = heading + pose.angles[index]
            ahead = np.array((math.cos(steered), math.sin(steered), 0.0))
            foot = np.array(pose.position) + away + _turned(wheel.corner, heading) + _turned(wheel.axle, steered)
            foot[2] = 0.02
            side = foot + 1.6 * wheel.axle[1] * np.array((-math.sin(steered), math.cos(steered), 0.0))
            normal.append((side, side + pose.normal_forces[index] / normal_scale * _UP))
            top = side + wheel.radius * _UP
            drive.append((top, top + pose.drive_forces[index] / drive_scale * ahead))
        self._normal.points = np.array(normal, dtype=np.float32)
        self._drive.points = np.array(drive, dtype=np.float32)

    def _remember(self, point: tuple[float, float, float]) -> None:
        if not self._path or math.dist(self._path[-1], point) > _SPACING:
            self._path.append(point)
            self._path_changed = len(self._path) > 1

    def _solid(self, name: str, shape: Shape) -> None:
        red, green, blue = (round(255 * part) for part in shape.colour)
        colour = (red, green, blue)
        if shape.kind is Kind.BOX:
            size = (2 * shape.half[0], 2 * shape.half[1], 2 * shape.half[2])
            self._scene.add_box(name, colour, size, position=shape.centre)
        else:
            upright = (1.0, 0.0, 0.0, 0.0)
            self._scene.add_cylinder(
                name,
                shape.radius,
                2 * shape.half_length,
                colour,
                wxyz=_LYING if shape.lying else upright,
                position=shape.centre,
            )

    def _look_from_behind(self, server: viser.ViserServer) -> None:
        camera = Camera((0.0, 0.0, 0.0), _DISTANCE * self._sketch.size, _AZIMUTH, _ELEVATION)
        server.initial_camera.position = camera.eye
        server.initial_camera.look_at = camera.target
        server.initial_camera.fov = math.radians(VIEW_ANGLE)


def _turned(vector: Vector, angle: float) -> NDArray[np.float64]:
    x, y, z = vector
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.array((cosine * x - sine * y, sine * x + cosine * y, z))

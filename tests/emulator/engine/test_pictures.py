"""What a picture of the vehicle shows, by every engine's renderer."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from emulator.as_built import AsBuilt
from emulator.engine.camera import Camera, follow
from emulator.engine.floor import draw_floor
from emulator.engine.mujoco.offscreen import choose_backend
from emulator.engine.protocol import MakePainter, Painter
from emulator.prototype import Prototype, load_prototype
from ident.errors import UserError

WIDTH, HEIGHT = 640, 360
STRAIGHT = [0.0] * 8
Picture = NDArray[np.uint8]


@pytest.fixture(params=["prototype", "compact"])
def prototype(request: pytest.FixtureRequest) -> Prototype:
    return load_prototype(request.param)


@pytest.fixture
def painter(prototype: Prototype, make_painter: MakePainter) -> Iterator[Painter]:
    painter = make_painter(AsBuilt.of(prototype), width=WIDTH, height=HEIGHT)
    yield painter
    painter.close()


def seen(painter: Painter, prototype: Prototype, angles: list[float], heading: float = 0.0, x: float = 0.0) -> Picture:
    position = (x, 0.0, prototype.body.centre_height)
    orientation = (0.0, 0.0, math.sin(heading / 2), math.cos(heading / 2))
    return painter.paint(position, orientation, angles, follow(prototype, position, orientation))


def mask(picture: Picture, colour: str) -> NDArray[np.bool_]:
    """Pixels (height, width) that are yellow (marks of the wheels), blue (steering units) or orange (the body)."""
    red, green, blue = (picture[..., channel].astype(int) for channel in range(3))
    return {
        "yellow": (red > 120) & (green > 0.75 * red) & (blue < 0.45 * red),
        "blue": (blue > 80) & (red < 0.4 * blue),
        "orange": (red > 80) & (green < 0.7 * red) & (blue < 0.35 * red),
    }[colour]


def place_of(prototype: Prototype, point: tuple[float, float, float]) -> tuple[float, float]:
    """Row and column at which the camera behind a vehicle at the origin sees a point of the world."""
    camera = follow(prototype, (0.0, 0.0, prototype.body.centre_height), (0.0, 0.0, 0.0, 1.0))
    forward = np.array(camera.forward)
    right = np.cross(forward, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    away = np.array(point) - camera.eye
    scale = HEIGHT / 2 / math.tan(math.radians(20.0)) / (away @ forward)
    return HEIGHT / 2 - scale * (away @ np.cross(right, forward)), WIDTH / 2 + scale * (away @ right)


def hub(prototype: Prototype, wheel: int) -> tuple[float, float, float]:
    """Centre of a wheel (fl, rl, fr, rr: 0 to 3) that is straight, of a vehicle at the origin."""
    geometry, front, left = prototype.geometry, wheel in (0, 2), wheel in (0, 1)
    aside = geometry.track_width / 2 + geometry.wheel_offset
    return (0.5 if front else -0.5) * geometry.wheelbase, aside if left else -aside, geometry.wheel_radius


def test_body_steering_units_and_marks_are_in_the_picture_and_the_body_is_in_its_middle(
    painter: Painter, prototype: Prototype
) -> None:
    picture = seen(painter, prototype, STRAIGHT)
    assert picture.shape == (HEIGHT, WIDTH, 3)
    assert picture.dtype == np.uint8
    rows, columns = np.nonzero(mask(picture, "orange"))
    assert len(rows) > 0.03 * WIDTH * HEIGHT
    assert abs(rows.mean() / HEIGHT - 0.5) < 0.1
    assert abs(columns.mean() / WIDTH - 0.5) < 0.1
    for colour in ("yellow", "blue"):
        assert mask(picture, colour).sum() > 50


@pytest.mark.parametrize("wheel", range(4), ids=["fl", "rl", "fr", "rr"])
def test_one_sees_a_wheel_turn(painter: Painter, prototype: Prototype, wheel: int) -> None:
    turned = [0.0] * 8
    turned[4 + wheel] = 1.0
    before, after = (mask(seen(painter, prototype, angles), "yellow") for angles in (STRAIGHT, turned))
    rows, columns = np.nonzero(before ^ after)
    assert len(rows) > 10
    # Only that wheel's mark: what differs is as small as a wheel.
    assert np.ptp(columns) < WIDTH / 8
    assert np.ptp(rows) < HEIGHT / 5
    row, column = place_of(prototype, hub(prototype, wheel))
    assert math.hypot(rows.mean() - row, columns.mean() - column) < HEIGHT / 12


def test_one_sees_a_unit_steer(painter: Painter, prototype: Prototype) -> None:
    steered = [0.5, -0.5, *[0.0] * 6]
    before, after = (mask(seen(painter, prototype, angles), "blue") for angles in (STRAIGHT, steered))
    assert (before ^ after).sum() > 50


def test_the_camera_follows_and_the_floor_shows_the_motion(painter: Painter, prototype: Prototype) -> None:
    here, there, round_about = (
        seen(painter, prototype, STRAIGHT, heading, x) for heading, x in ((0.0, 0.0), (0.0, 0.5), (0.7, 0.0))
    )
    body = mask(here, "orange")
    for moved in (there, round_about):
        assert (body ^ mask(moved, "orange")).sum() < 0.05 * body.sum()
        assert (np.abs(moved.astype(int) - here).max(axis=-1) > 10)[: HEIGHT // 4].mean() > 0.05


def test_the_same_vehicle_gives_the_same_picture(painter: Painter, prototype: Prototype) -> None:
    first = seen(painter, prototype, STRAIGHT)
    seen(painter, prototype, [0.3] * 8, 1.0, 2.0)
    assert np.array_equal(seen(painter, prototype, STRAIGHT), first)


def test_every_engine_draws_the_vehicle_where_the_camera_sees_it(painter: Painter, prototype: Prototype) -> None:
    """The lowest corner in the picture is the one at the left rear, below."""
    geometry = prototype.geometry
    side = max(geometry.track_width / 2 - 1.6 * geometry.wheel_radius, geometry.track_width / 8)
    row, column = place_of(prototype, (-prototype.body.length / 2, side, 2.1 * geometry.wheel_radius))
    rows, columns = np.nonzero(mask(seen(painter, prototype, STRAIGHT), "orange"))
    assert rows.max() == pytest.approx(row, abs=3)
    assert columns[rows.argmax()] == pytest.approx(column, abs=8)


def test_squares_of_the_floor_are_a_metre_wide_and_the_shadow_is_below_the_vehicle() -> None:
    """Seen from straight above, almost: 45 pixels are a metre."""
    prototype = load_prototype()
    height = 400
    up = height / 2 / 45 / math.tan(math.radians(20.0))
    camera = Camera((0.0, 0.0, 0.0), up, 0.0, -math.pi / 2 + 1e-6)
    plain = draw_floor(camera, height, height, prototype, (100.0, 0.0, 0.0))[..., 1].astype(float)
    row = plain[height // 2 - 22]
    edges = np.nonzero(np.diff((row > row.mean()).astype(int)))[0]
    assert np.diff(edges) == pytest.approx(45, abs=1)
    shaded = draw_floor(camera, height, height, prototype, (0.0, 0.0, 0.0))[..., 1].astype(float)
    rows, columns = np.nonzero(shaded < plain - 40)
    # Ahead is up: the shadow is longer than it is wide.
    assert np.ptp(rows) == pytest.approx(45 * prototype.body.length, abs=6)
    assert np.ptp(columns) == pytest.approx(45 * prototype.geometry.track_width, abs=6)


@pytest.mark.parametrize(
    ("variable", "platform", "libraries", "chosen"),
    [
        ("", "linux", ("OSMesa", "EGL"), "osmesa"),
        ("", "linux", ("EGL",), "egl"),
        ("EGL", "linux", ("OSMesa", "EGL"), "egl"),
        ("glfw", "linux", (), "glfw"),
        ("", "darwin", (), "cgl"),
        ("", "win32", (), "glfw"),
    ],
)
def test_opengl_is_what_the_variable_says_or_what_needs_no_display(
    variable: str, platform: str, libraries: tuple[str, ...], chosen: str
) -> None:
    environment = {"MUJOCO_GL": variable} if variable else {}
    assert choose_backend(environment, platform, libraries.__contains__) == chosen


def test_where_there_is_no_opengl_the_remedy_is_said() -> None:
    with pytest.raises(UserError) as caught:
        choose_backend({}, "linux", ().__contains__)
    assert "apt install libosmesa6" in caught.value.remedy
    with pytest.raises(UserError, match="disable"):
        choose_backend({"MUJOCO_GL": "disable"}, "linux", ("OSMesa",).__contains__)

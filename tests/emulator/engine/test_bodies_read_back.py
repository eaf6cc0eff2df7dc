"""What every engine took from its description is the truth: read back, body by body, and added up from scratch."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Mapping

import numpy as np
import pytest

from emulator.as_built import AsBuilt
from emulator.engine.protocol import Engine, MakeEngine
from emulator.engine.pybullet.urdf import generate_urdf
from emulator.prototype import Prototype, load_prototype
from emulator.rigid_bodies import RigidBody

PROTOTYPES = ("prototype", "compact")


@pytest.fixture(params=PROTOTYPES)
def prototype(request: pytest.FixtureRequest) -> Prototype:
    return load_prototype(request.param)


@pytest.fixture
def engine(prototype: Prototype, make_engine: MakeEngine) -> Iterator[Engine]:
    engine = make_engine(AsBuilt.of(prototype), step_size=1e-3, gui=False)
    yield engine
    engine.close()


@pytest.fixture
def bodies(engine: Engine) -> Mapping[str, RigidBody]:
    return engine.bodies()


def steering_axis(prototype: Prototype, wheel: str) -> np.ndarray:
    end, side = {"f": 1, "r": -1}[wheel[0]], {"l": 1, "r": -1}[wheel[1]]
    return np.array([end * prototype.geometry.wheelbase / 2, side * prototype.geometry.track_width / 2])


def yaw_inertia(bodies: Mapping[str, RigidBody], names: list[str], point: np.ndarray) -> float:
    """Parallel axes: sum of I_zz + m d^2 about a vertical axis through `point`."""
    return sum(
        bodies[name].inertia[2] + bodies[name].mass * float(np.sum((np.array(bodies[name].centre[:2]) - point) ** 2))
        for name in names
    )


def test_no_inertia_was_silently_zeroed(bodies: Mapping[str, RigidBody]) -> None:
    assert len(bodies) == 9
    for name, body in bodies.items():
        assert min(body.inertia) > 0, name
        assert 2 * max(body.inertia) < sum(body.inertia), name


def test_the_total_mass_is_m_ch(prototype: Prototype, bodies: Mapping[str, RigidBody]) -> None:
    assert sum(body.mass for body in bodies.values()) == pytest.approx(prototype.truth["m_ch"], rel=1e-12)


def test_the_total_yaw_inertia_is_c_ch_and_both_sides(prototype: Prototype, bodies: Mapping[str, RigidBody]) -> None:
    truth = prototype.truth
    total = yaw_inertia(bodies, list(bodies), np.zeros(2))
    assert total == pytest.approx(truth["C_ch"] + truth["C_l"] + truth["C_r"], rel=1e-12)


@pytest.mark.parametrize(("side", "symbol"), [("l", "C_l"), ("r", "C_r")])
def test_the_units_of_a_side_have_its_yaw_inertia(
    prototype: Prototype, bodies: Mapping[str, RigidBody], side: str, symbol: str
) -> None:
    total = sum(
        yaw_inertia(bodies, [f"knuckle_{end}{side}", f"wheel_{end}{side}"], steering_axis(prototype, end + side))
        for end in ("f", "r")
    )
    assert total == pytest.approx(prototype.truth[symbol], rel=1e-12)


def test_the_wheels_spin_with_b_w_about_their_axle(prototype: Prototype, bodies: Mapping[str, RigidBody]) -> None:
    for wheel in ("fl", "rl", "fr", "rr"):
        assert bodies[f"wheel_{wheel}"].inertia[1] == pytest.approx(prototype.truth["B_w"], rel=1e-12)


def test_each_unit_balances_on_its_steering_axis(prototype: Prototype, bodies: Mapping[str, RigidBody]) -> None:
    for wheel in ("fl", "rl", "fr", "rr"):
        names = (f"knuckle_{wheel}", f"wheel_{wheel}")
        moment = sum(bodies[name].mass * np.array(bodies[name].centre[:2]) for name in names)
        centre = moment / sum(bodies[name].mass for name in names)
        assert centre == pytest.approx(steering_axis(prototype, wheel), abs=1e-12)


def test_wheels_stand_outside_their_steering_axes_by_a(prototype: Prototype, bodies: Mapping[str, RigidBody]) -> None:
    geometry = prototype.geometry
    for wheel in ("fl", "rl", "fr", "rr"):
        outward = np.sign(steering_axis(prototype, wheel)[1]) * geometry.wheel_offset
        from_axis = np.array(bodies[f"wheel_{wheel}"].centre[:2]) - steering_axis(prototype, wheel)
        assert from_axis == pytest.approx([0.0, outward], abs=1e-12)
        below_centre = bodies["chassis"].centre[2] - bodies[f"wheel_{wheel}"].centre[2]
        assert below_centre == pytest.approx(prototype.body.centre_height - geometry.wheel_radius)


def test_the_centre_of_mass_is_the_geometric_centre(bodies: Mapping[str, RigidBody]) -> None:
    moment = sum(body.mass * np.array(body.centre[:2]) for body in bodies.values())
    assert moment == pytest.approx([0.0, 0.0], abs=1e-9)


def test_the_steering_has_stops(prototype: Prototype, engine: Engine) -> None:
    limit = prototype.geometry.steering_limit
    assert limit > math.pi / 2
    assert engine.steering_stops() == [(-limit, limit)] * 4


def test_wheels_turn_without_end(prototype: Prototype, engine: Engine) -> None:
    engine.place(on_stand=True, angles=[0.0] * 8)
    for _ in range(2000):
        engine.step([0.0] * 4 + [20 * prototype.truth["d_cw"]] * 4)
    assert min(engine.angles()[4:]) > 4 * math.pi


def test_people_see_cylinders_while_spheres_touch_the_floor(prototype: Prototype) -> None:
    robot = ElementTree.fromstring(generate_urdf(AsBuilt.of(prototype)))
    for wheel in ("fl", "rl", "fr", "rr"):
        link = robot.find(f"link[@name='wheel_{wheel}']")
        assert link is not None
        assert link.find("visual/geometry/cylinder") is not None
        sphere = link.find("collision/geometry/sphere")
        assert sphere is not None
        assert float(sphere.attrib["radius"]) == prototype.geometry.wheel_radius
    assert len(robot.findall("link/collision")) == 4

"""What the engine took from the URDF is the truth: read back, body by body, and added up from scratch."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass

import numpy as np
import pybullet
import pytest

from emulator.as_built import AsBuilt
from emulator.engine.pybullet.urdf import generate_urdf
from emulator.prototype import Prototype, load_prototype
from emulator.vehicle import EmulatedVehicle

PROTOTYPES = ("prototype", "compact")


@dataclass(frozen=True)
class ReadBack:
    """Bodies as the engine holds them: mass, inertia diagonal, centre of mass in the world at zero angles."""

    mass: dict[str, float]
    inertia: dict[str, np.ndarray]
    centre: dict[str, np.ndarray]
    joint_axis: dict[str, np.ndarray]
    joint_limits: dict[str, tuple[float, float]]


def read_back(prototype: Prototype) -> ReadBack:
    result = ReadBack({}, {}, {}, {}, {})
    with EmulatedVehicle(prototype, seed=0, noise_scale=0.0) as vehicle:
        engine = vehicle.engine
        engine.place(on_stand=False, angles=[0.0] * 8)
        for link in range(-1, pybullet.getNumJoints(engine.body, engine.client)):
            info = pybullet.getDynamicsInfo(engine.body, link, engine.client)
            if link < 0:
                name, centre = "chassis", engine.base_pose()[0]
            else:
                joint = pybullet.getJointInfo(engine.body, link, engine.client)
                name = joint[12].decode()
                centre = pybullet.getLinkState(engine.body, link, physicsClientId=engine.client)[0]
                result.joint_axis[name] = np.array(joint[13])
                result.joint_limits[name] = (joint[8], joint[9])
            result.mass[name] = info[0]
            result.inertia[name] = np.array(info[2])
            result.centre[name] = np.array(centre)
    return result


@pytest.fixture(params=PROTOTYPES, scope="module")
def prototype(request: pytest.FixtureRequest) -> Prototype:
    return load_prototype(request.param)


@pytest.fixture(scope="module")
def bodies(prototype: Prototype) -> ReadBack:
    return read_back(prototype)


def steering_axis(prototype: Prototype, wheel: str) -> np.ndarray:
    end, side = {"f": 1, "r": -1}[wheel[0]], {"l": 1, "r": -1}[wheel[1]]
    return np.array([end * prototype.geometry.wheelbase / 2, side * prototype.geometry.track_width / 2])


def yaw_inertia(bodies: ReadBack, names: list[str], point: np.ndarray) -> float:
    """Parallel axes: sum of I_zz + m d^2 about a vertical axis through `point`."""
    return sum(
        bodies.inertia[name][2] + bodies.mass[name] * float(np.sum((bodies.centre[name][:2] - point) ** 2))
        for name in names
    )


def test_no_inertia_was_silently_zeroed(bodies: ReadBack) -> None:
    assert len(bodies.mass) == 9
    for name, inertia in bodies.inertia.items():
        assert np.all(inertia > 0), name
        assert 2 * inertia.max() < inertia.sum(), name


def test_the_total_mass_is_m_ch(prototype: Prototype, bodies: ReadBack) -> None:
    assert sum(bodies.mass.values()) == pytest.approx(prototype.truth["m_ch"], rel=1e-12)


def test_the_total_yaw_inertia_is_c_ch_and_both_sides(prototype: Prototype, bodies: ReadBack) -> None:
    truth = prototype.truth
    total = yaw_inertia(bodies, list(bodies.mass), np.zeros(2))
    assert total == pytest.approx(truth["C_ch"] + truth["C_l"] + truth["C_r"], rel=1e-12)


@pytest.mark.parametrize(("side", "symbol"), [("l", "C_l"), ("r", "C_r")])
def test_the_units_of_a_side_have_its_yaw_inertia(
    prototype: Prototype, bodies: ReadBack, side: str, symbol: str
) -> None:
    total = sum(
        yaw_inertia(bodies, [f"knuckle_{end}{side}", f"wheel_{end}{side}"], steering_axis(prototype, end + side))
        for end in ("f", "r")
    )
    assert total == pytest.approx(prototype.truth[symbol], rel=1e-12)


def test_the_wheels_spin_with_b_w_about_their_axle(prototype: Prototype, bodies: ReadBack) -> None:
    for wheel in ("fl", "rl", "fr", "rr"):
        axis = bodies.joint_axis[f"wheel_{wheel}"]
        assert axis == pytest.approx([0.0, 1.0, 0.0])
        spin = float(axis**2 @ bodies.inertia[f"wheel_{wheel}"])
        assert spin == pytest.approx(prototype.truth["B_w"], rel=1e-12)


def test_each_unit_balances_on_its_steering_axis(prototype: Prototype, bodies: ReadBack) -> None:
    for wheel in ("fl", "rl", "fr", "rr"):
        names = (f"knuckle_{wheel}", f"wheel_{wheel}")
        moment = sum(bodies.mass[name] * bodies.centre[name][:2] for name in names)
        centre = moment / sum(bodies.mass[name] for name in names)
        assert centre == pytest.approx(steering_axis(prototype, wheel), abs=1e-12)


def test_wheels_stand_outside_their_steering_axes_by_a(prototype: Prototype, bodies: ReadBack) -> None:
    geometry = prototype.geometry
    for wheel in ("fl", "rl", "fr", "rr"):
        outward = np.sign(steering_axis(prototype, wheel)[1]) * geometry.wheel_offset
        from_axis = bodies.centre[f"wheel_{wheel}"][:2] - steering_axis(prototype, wheel)
        assert from_axis == pytest.approx([0.0, outward], abs=1e-12)
        below_centre = bodies.centre["chassis"][2] - bodies.centre[f"wheel_{wheel}"][2]
        assert below_centre == pytest.approx(prototype.body.centre_height - geometry.wheel_radius)


def test_the_centre_of_mass_is_the_geometric_centre(bodies: ReadBack) -> None:
    moment = sum(bodies.mass[name] * bodies.centre[name][:2] for name in bodies.mass)
    assert moment == pytest.approx([0.0, 0.0], abs=1e-9)


def test_the_steering_has_stops_and_the_wheels_have_none(prototype: Prototype, bodies: ReadBack) -> None:
    limit = prototype.geometry.steering_limit
    assert limit > math.pi / 2
    for wheel in ("fl", "rl", "fr", "rr"):
        assert bodies.joint_limits[f"knuckle_{wheel}"] == (-limit, limit)
        lower, upper = bodies.joint_limits[f"wheel_{wheel}"]
        assert upper <= lower, "a continuous joint, in the engine's notation"


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

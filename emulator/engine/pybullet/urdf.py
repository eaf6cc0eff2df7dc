"""The vehicle as URDF, generated from the prototype; joints and frames as `emulator.engine.layout` has them.

The wheel touches the floor as a sphere: one contact point, exactly below the wheel's centre at distance r whatever the
load, which is the point contact that the constraints (1) assume. What one sees is a cylinder with a spoke.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

from emulator.as_built import AsBuilt, WheelBuild
from emulator.engine.layout import (
    BODY_COLOUR,
    KNUCKLE_COLOUR,
    MARK_COLOUR,
    TYRE_COLOUR,
    TYRE_WIDTH_RATIO,
    axle,
    body_lift,
    corner,
    rolling_joint,
    steering_joint,
    tyre_centre,
)
from emulator.prototype import Prototype
from emulator.rigid_bodies import RigidBody
from ident.vehicle.geometry import WHEELS

LINK_ORDER: Final = ("fl", "rl", "rr", "fr")
"""Order of the wheels in the file, once around the vehicle. The engine relaxes contacts in this order: side by
side, what the iteration leaves over pushes the vehicle a tenth of a millimetre during one steering step;
around the vehicle it cancels to micrometres."""


def generate_urdf(built: AsBuilt) -> str:
    """URDF text of a vehicle as built; masses [kg], lengths [m], inertias [kg m^2]."""
    prototype = built.prototype
    parts = ['<?xml version="1.0"?>', f'<robot name="{prototype.name}">', *_chassis(prototype)]
    knuckles = dict(zip(WHEELS, prototype.rigid_bodies.knuckles, strict=True))
    wheels = dict(zip(WHEELS, built.wheels, strict=True))
    for wheel in LINK_ORDER:
        parts += _knuckle(prototype, wheel, knuckles[wheel])
        parts += _wheel(prototype, wheel, wheels[wheel])
    return "\n".join([*parts, "</robot>", ""])


def _vector(*values: float) -> str:
    return " ".join(f"{value:.17g}" for value in values)


def _inertial(body: RigidBody) -> str:
    xx, yy, zz = (f"{value:.17g}" for value in body.inertia)
    return (
        f'<inertial><origin xyz="{_vector(*body.centre)}"/><mass value="{body.mass:.17g}"/>'
        f'<inertia ixx="{xx}" ixy="0" ixz="0" iyy="{yy}" iyz="0" izz="{zz}"/></inertial>'
    )


def _visual(shape: str, colour: tuple[float, ...], name: str, xyz: str = "0 0 0", rpy: str = "0 0 0") -> str:
    return (
        f'<visual><origin xyz="{xyz}" rpy="{rpy}"/><geometry>{shape}</geometry>'
        f'<material name="{name}"><color rgba="{_vector(*colour)}"/></material></visual>'
    )


def _chassis(prototype: Prototype) -> Iterator[str]:
    body = prototype.body
    box = f'<box size="{_vector(body.length, body.width, body.height)}"/>'
    yield '<link name="chassis">'
    yield _inertial(prototype.rigid_bodies.chassis)
    yield _visual(box, BODY_COLOUR, "body", xyz=_vector(0, 0, body_lift(prototype)))
    yield "</link>"


def _knuckle(prototype: Prototype, wheel: str, body: RigidBody) -> Iterator[str]:
    geometry = prototype.geometry
    limit = f"{geometry.steering_limit:.17g}"
    radius, length = _vector(geometry.wheel_radius / 4), _vector(2 * geometry.wheel_radius)
    post = _visual(f'<cylinder radius="{radius}" length="{length}"/>', KNUCKLE_COLOUR, "knuckle")
    yield f'<link name="knuckle_{wheel}">{_inertial(body)}{post}</link>'
    yield f'<joint name="{steering_joint(wheel)}" type="revolute">'
    yield f'<parent link="chassis"/><child link="knuckle_{wheel}"/>'
    yield f'<origin xyz="{_vector(*corner(prototype, wheel))}"/><axis xyz="0 0 1"/>'
    yield f'<limit lower="-{limit}" upper="{limit}" effort="0" velocity="0"/></joint>'


def _wheel(prototype: Prototype, wheel: str, build: WheelBuild) -> Iterator[str]:
    geometry = prototype.geometry
    radius = f"{build.radius:.17g}"
    centre = tyre_centre(build)
    half_width = TYRE_WIDTH_RATIO * geometry.wheel_radius / 2
    tyre = f'<cylinder radius="{radius}" length="{_vector(2 * half_width)}"/>'
    spoke = f'<box size="{_vector(build.radius / 5, 2.04 * half_width, 0.96 * build.radius)}"/>'
    in_spoke = _vector(centre[0], 0, centre[2] + build.radius / 2)
    yield f'<link name="wheel_{wheel}">{_inertial(build.body)}'
    yield _visual(tyre, TYRE_COLOUR, "tyre", xyz=_vector(*centre), rpy=_vector(math.pi / 2, 0, 0))
    yield _visual(spoke, MARK_COLOUR, "mark", xyz=in_spoke)
    yield f'<collision><origin xyz="{_vector(*centre)}"/><geometry><sphere radius="{radius}"/></geometry></collision>'
    yield "</link>"
    yield f'<joint name="{rolling_joint(wheel)}" type="continuous">'
    yield f'<parent link="knuckle_{wheel}"/><child link="wheel_{wheel}"/>'
    yield f'<origin xyz="{_vector(*axle(prototype, wheel, build))}"/><axis xyz="0 1 0"/></joint>'

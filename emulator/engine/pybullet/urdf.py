"""The vehicle as URDF, generated from the prototype; joints and frames as `emulator.engine.layout` has them.

The wheel touches the floor as a sphere: one contact point, exactly below the wheel's centre at distance r whatever the
load, which is the point contact that the constraints (1) assume. What one sees is in `emulator.engine.looks`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

from emulator.as_built import AsBuilt, WheelBuild
from emulator.engine.layout import axle, corner, rolling_joint, steering_joint, tyre_centre
from emulator.engine.looks import Kind, Shape, chassis_shapes, knuckle_shapes, wheel_shapes
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
        parts += _knuckle(prototype, wheel, knuckles[wheel], wheels[wheel])
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


def _visual(shape: Shape) -> str:
    size = (
        f'<box size="{_vector(*(2 * half for half in shape.half))}"/>'
        if shape.kind is Kind.BOX
        else f'<cylinder radius="{_vector(shape.radius)}" length="{_vector(2 * shape.half_length)}"/>'
    )
    # A material is known by its name: one of another colour needs another name.
    name = "-".join(f"{round(255 * part)}" for part in shape.colour)
    return (
        f'<visual><origin xyz="{_vector(*shape.centre)}" rpy="{_vector(math.pi / 2 if shape.lying else 0, 0, 0)}"/>'
        f'<geometry>{size}</geometry><material name="{name}"><color rgba="{_vector(*shape.colour, 1)}"/></material>'
        "</visual>"
    )


def _chassis(prototype: Prototype) -> Iterator[str]:
    yield '<link name="chassis">'
    yield _inertial(prototype.rigid_bodies.chassis)
    yield from map(_visual, chassis_shapes(prototype))
    yield "</link>"


def _knuckle(prototype: Prototype, wheel: str, body: RigidBody, build: WheelBuild) -> Iterator[str]:
    limit = f"{prototype.geometry.steering_limit:.17g}"
    yield f'<link name="knuckle_{wheel}">{_inertial(body)}'
    yield from map(_visual, knuckle_shapes(prototype, wheel, build))
    yield "</link>"
    yield f'<joint name="{steering_joint(wheel)}" type="revolute">'
    yield f'<parent link="chassis"/><child link="knuckle_{wheel}"/>'
    yield f'<origin xyz="{_vector(*corner(prototype, wheel))}"/><axis xyz="0 0 1"/>'
    yield f'<limit lower="-{limit}" upper="{limit}" effort="0" velocity="0"/></joint>'


def _wheel(prototype: Prototype, wheel: str, build: WheelBuild) -> Iterator[str]:
    radius = f"{build.radius:.17g}"
    centre = tyre_centre(build)
    yield f'<link name="wheel_{wheel}">{_inertial(build.body)}'
    yield from map(_visual, wheel_shapes(prototype, build))
    yield f'<collision><origin xyz="{_vector(*centre)}"/><geometry><sphere radius="{radius}"/></geometry></collision>'
    yield "</link>"
    yield f'<joint name="{rolling_joint(wheel)}" type="continuous">'
    yield f'<parent link="knuckle_{wheel}"/><child link="wheel_{wheel}"/>'
    yield f'<origin xyz="{_vector(*axle(prototype, wheel, build))}"/><axis xyz="0 1 0"/></joint>'

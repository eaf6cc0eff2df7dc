"""The vehicle as URDF, generated from the prototype.

Frames: x forward, y left, z up. Link `chassis` with its origin over the centre of the four steering axes; joint
`steering_<wheel>` about z at each corner; joint `rolling_<wheel>` about the wheel's axle (y of the knuckle),
positive when the wheel rolls forward. The wheel touches the floor as a sphere: one contact point,
exactly below the wheel's centre at distance r whatever the load, which is the point contact that the
constraints (1) assume. What one sees is a cylinder.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

from emulator.as_built import AsBuilt, WheelBuild
from emulator.prototype import Prototype
from emulator.rigid_bodies import RigidBody
from ident.vehicle.geometry import WHEELS

SIDE_SIGN: Final = {"fl": 1.0, "rl": 1.0, "fr": -1.0, "rr": -1.0}
"""+1 left, -1 right."""
END_SIGN: Final = {"fl": 1.0, "rl": -1.0, "fr": 1.0, "rr": -1.0}
"""+1 front, -1 rear."""

LINK_ORDER: Final = ("fl", "rl", "rr", "fr")
"""Order of the wheels in the file, once around the vehicle. The engine relaxes contacts in this order: side by
side, what the iteration leaves over pushes the vehicle a tenth of a millimetre during one steering step;
around the vehicle it cancels to micrometres."""

TYRE_WIDTH_RATIO: Final = 0.5
"""Width of the tyre that one sees over the wheel radius."""

_BODY_COLOUR: Final = "0.85 0.45 0.10 1"
_KNUCKLE_COLOUR: Final = "0.55 0.57 0.60 1"
_TYRE_COLOUR: Final = "0.12 0.12 0.13 1"


def steering_joint(wheel: str) -> str:
    """Name of the steering joint of a wheel."""
    return f"steering_{wheel}"


def rolling_joint(wheel: str) -> str:
    """Name of the rolling joint of a wheel."""
    return f"rolling_{wheel}"


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


def _visual(shape: str, colour: str, name: str, xyz: str = "0 0 0", rpy: str = "0 0 0") -> str:
    return (
        f'<visual><origin xyz="{xyz}" rpy="{rpy}"/><geometry>{shape}</geometry>'
        f'<material name="{name}"><color rgba="{colour}"/></material></visual>'
    )


def _chassis(prototype: Prototype) -> Iterator[str]:
    body = prototype.body
    box = f'<box size="{_vector(body.length, body.width, body.height)}"/>'
    yield '<link name="chassis">'
    yield _inertial(prototype.rigid_bodies.chassis)
    # Seen above the wheels; the mass stays where it is.
    lift = 2 * prototype.geometry.wheel_radius + body.height / 2 - body.centre_height
    yield _visual(box, _BODY_COLOUR, "body", xyz=_vector(0, 0, lift))
    yield "</link>"


def _knuckle(prototype: Prototype, wheel: str, body: RigidBody) -> Iterator[str]:
    geometry = prototype.geometry
    corner = _vector(
        END_SIGN[wheel] * geometry.wheelbase / 2,
        SIDE_SIGN[wheel] * geometry.track_width / 2,
        geometry.wheel_radius - prototype.body.centre_height,
    )
    limit = f"{geometry.steering_limit:.17g}"
    radius, length = _vector(geometry.wheel_radius / 4), _vector(2 * geometry.wheel_radius)
    post = _visual(f'<cylinder radius="{radius}" length="{length}"/>', _KNUCKLE_COLOUR, "knuckle")
    yield f'<link name="knuckle_{wheel}">{_inertial(body)}{post}</link>'
    yield f'<joint name="{steering_joint(wheel)}" type="revolute">'
    yield f'<parent link="chassis"/><child link="knuckle_{wheel}"/>'
    yield f'<origin xyz="{corner}"/><axis xyz="0 0 1"/>'
    yield f'<limit lower="-{limit}" upper="{limit}" effort="0" velocity="0"/></joint>'


def _wheel(prototype: Prototype, wheel: str, build: WheelBuild) -> Iterator[str]:
    geometry = prototype.geometry
    radius = f"{build.radius:.17g}"
    width = _vector(TYRE_WIDTH_RATIO * geometry.wheel_radius)
    tyre = f'<cylinder radius="{radius}" length="{width}"/>'
    # The axle of a larger wheel sits higher, so that all four wheels stand on the floor alike.
    offset = _vector(0, SIDE_SIGN[wheel] * geometry.wheel_offset, build.radius - geometry.wheel_radius)
    # Turned by beta about the axle, the centre stands eccentricity cos(beta + phase) below it.
    centre = _vector(-build.eccentricity * math.sin(build.phase), 0, -build.eccentricity * math.cos(build.phase))
    yield f'<link name="wheel_{wheel}">{_inertial(build.body)}'
    yield _visual(tyre, _TYRE_COLOUR, "tyre", xyz=centre, rpy=_vector(math.pi / 2, 0, 0))
    yield f'<collision><origin xyz="{centre}"/><geometry><sphere radius="{radius}"/></geometry></collision></link>'
    yield f'<joint name="{rolling_joint(wheel)}" type="continuous">'
    yield f'<parent link="knuckle_{wheel}"/><child link="wheel_{wheel}"/>'
    yield f'<origin xyz="{offset}"/><axis xyz="0 1 0"/></joint>'

"""The vehicle as MJCF, generated from the prototype; joints and frames as `emulator.engine.layout` has them.

A wheel touches the floor as a sphere: one contact point below the wheel's centre, which is the point contact that the
constraints (1) assume. MuJoCo puts it halfway into the overlap of tyre and floor; the sphere is larger by half of the
overlap under a quarter of the weight, so that the wheel rolls on its radius. What one sees is in
`emulator.engine.looks`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from emulator.as_built import AsBuilt, WheelBuild
from emulator.engine.camera import HEIGHT, VIEW_ANGLE, WIDTH
from emulator.engine.layout import (
    axle,
    corner,
    rolling_joint,
    steering_joint,
    tyre_centre,
)
from emulator.engine.looks import TYRE_WIDTH_RATIO, Kind, Shape, chassis_shapes, knuckle_shapes, wheel_shapes
from emulator.prototype import Prototype
from emulator.rigid_bodies import RigidBody
from ident.vehicle.geometry import WHEELS
from ident.vehicle.quantities import GRAVITY

_LIGHT: Final = (
    '<light mode="trackcom" pos="-0.3 0.3 3" dir="0.1 -0.1 -1" directional="true" ambient="0.1 0.1 0.1" '
    'diffuse="0.5 0.5 0.5"/>'
)
"""It goes with the vehicle, for its shadow is as sharp as the region that it lights is small."""

HARDEST: Final = 0.9999
"""Impedance of what shall not give way; the largest that MuJoCo takes."""


@dataclass(frozen=True)
class SolverSettings:
    """Settings of the engine; the defaults are the ones measured in docs/emulator.md.

    Attributes:
        solver: `Newton`, `CG` or `PGS`.
        cone: `elliptic` or `pyramidal`.
        iterations: most iterations of the solver a step.
        tolerance: of the solver, on the scaled gradient and improvement.
        noslip_iterations: sweeps that take friction's remaining creep back.
        impratio: hardness of contact friction over that of the contact normal.
        contact_impedance: d of the contact normal; the rest, 1 - d, gives way as the tyre's stiffness says.
        wheel_shape: `sphere` or `cylinder`.
    """

    solver: str = "Newton"
    cone: str = "elliptic"
    iterations: int = 100
    tolerance: float = 1e-12
    noslip_iterations: int = 0
    impratio: float = 100.0
    contact_impedance: float = 0.9
    wheel_shape: str = "sphere"


DEFAULT_SOLVER: Final = SolverSettings()


def generate_mjcf(
    built: AsBuilt, *, step_size: float, on_stand: bool, settings: SolverSettings = DEFAULT_SOLVER
) -> str:
    """MJCF text of a vehicle as built; masses [kg], lengths [m], inertias [kg m^2].

    Stiffness of the contacts is set once the engine has compiled it, for it is relative to inverse masses.

    Args:
        built: the vehicle.
        step_size: [s].
        on_stand: chassis fixed to the world, which takes any reaction; else it floats.
        settings: of solver and contacts.
    """
    prototype = built.prototype
    wheels = dict(zip(WHEELS, built.wheels, strict=True))
    knuckles = dict(zip(WHEELS, prototype.rigid_bodies.knuckles, strict=True))
    base = "" if on_stand else '<freejoint name="base"/>'
    parts = [
        f'<mujoco model="{prototype.name}">',
        '<compiler angle="radian" autolimits="false" inertiafromgeom="false"/>',
        *_option(built, step_size, settings),
        *_looks(prototype.geometry.wheelbase + prototype.geometry.track_width),
        "<worldbody>",
        '<geom name="floor" type="plane" size="60 60 1" material="floor" contype="0" conaffinity="0"/>',
        f'<body name="chassis">{base}{_inertial(prototype.rigid_bodies.chassis)}',
        _LIGHT,
        *map(_seen, chassis_shapes(prototype)),
    ]
    for wheel in WHEELS:
        parts += _unit(prototype, wheel, knuckles[wheel], wheels[wheel], step_size, settings)
    parts += ["</body>", "</worldbody>", "<contact>"]
    parts += [_pair(prototype, wheel, wheels[wheel], step_size, settings) for wheel in WHEELS]
    parts += ["</contact>", "<equality>", *_couplings(built, step_size), "</equality>", "</mujoco>", ""]
    return "\n".join(parts)


def _numbers(*values: float) -> str:
    return " ".join(f"{value:.17g}" for value in values)


def _hard(step_size: float, kind: str = "") -> str:
    """Reference and impedance of a constraint that shall not give way: back within two steps, critically damped."""
    return f'solref{kind}="{_numbers(2 * step_size, 1)}" solimp{kind}="{_numbers(HARDEST, HARDEST, 1e-3, 0.5, 2)}"'


def _option(built: AsBuilt, step_size: float, settings: SolverSettings) -> Iterator[str]:
    yield (
        f'<option timestep="{_numbers(step_size)}" gravity="{_numbers(*built.gravity)}" integrator="Euler" '
        f'solver="{settings.solver}" cone="{settings.cone}" iterations="{settings.iterations}" '
        f'tolerance="{settings.tolerance:g}" noslip_iterations="{settings.noslip_iterations}" '
        f'noslip_tolerance="0" impratio="{settings.impratio:g}" jacobian="dense"/>'
    )


def _looks(extent: float) -> Iterator[str]:
    """Camera, light and floor for a vehicle of that size [m]."""
    yield (
        f'<visual><global offwidth="{WIDTH}" offheight="{HEIGHT}" fovy="{VIEW_ANGLE:g}"/>'
        '<headlight ambient="0.3 0.3 0.3" diffuse="0.2 0.2 0.2" specular="0 0 0"/><quality shadowsize="2048"/>'
        f'<map shadowclip="2" zfar="15"/></visual><statistic extent="{extent:g}" center="0 0 0"/>'
    )
    yield "<asset>"
    yield (
        '<texture name="squares" type="2d" builtin="checker" width="300" height="300" '
        'rgb1="0.82 0.84 0.86" rgb2="0.70 0.73 0.76"/>'
    )
    # One square a metre.
    yield '<material name="floor" texture="squares" texrepeat="1 1" texuniform="true" reflectance="0"/>'
    yield "</asset>"


def _inertial(body: RigidBody) -> str:
    place, inertia = _numbers(*body.centre), _numbers(*body.inertia)
    return f'<inertial pos="{place}" mass="{_numbers(body.mass)}" diaginertia="{inertia}"/>'


def _seen(shape: Shape) -> str:
    size = shape.half if shape.kind is Kind.BOX else (shape.radius, shape.half_length)
    lying = f'euler="{_numbers(math.pi / 2, 0, 0)}"' if shape.lying else ""
    return (
        f'<geom type="{shape.kind}" size="{_numbers(*size)}" pos="{_numbers(*shape.centre)}" {lying} '
        f'rgba="{_numbers(*shape.colour, 1)}" contype="0" conaffinity="0"/>'
    )


def _unit(
    prototype: Prototype,
    wheel: str,
    knuckle: RigidBody,
    build: WheelBuild,
    step_size: float,
    settings: SolverSettings,
) -> Iterator[str]:
    """A steering unit: knuckle, and in it the wheel."""
    limit = prototype.geometry.steering_limit
    friction = _hard(step_size, "friction")
    yield f'<body name="knuckle_{wheel}" pos="{_numbers(*corner(prototype, wheel))}">{_inertial(knuckle)}'
    yield (
        f'<joint name="{steering_joint(wheel)}" type="hinge" axis="0 0 1" limited="true" '
        f'range="{_numbers(-limit, limit)}" {_hard(step_size, "limit")} {friction}/>'
    )
    yield from map(_seen, knuckle_shapes(prototype, wheel, build))
    yield f'<body name="wheel_{wheel}" pos="{_numbers(*axle(prototype, wheel, build))}">{_inertial(build.body)}'
    yield f'<joint name="{rolling_joint(wheel)}" type="hinge" axis="0 1 0" {friction}/>'
    yield from _tyre(prototype, wheel, build, settings)
    yield "</body></body>"


def _tyre(prototype: Prototype, wheel: str, build: WheelBuild, settings: SolverSettings) -> Iterator[str]:
    """What touches the floor, and what one sees of it."""
    centre, half_width = tyre_centre(build), TYRE_WIDTH_RATIO * prototype.geometry.wheel_radius / 2
    cylinder, lying = _numbers(build.radius, half_width), f'euler="{_numbers(math.pi / 2, 0, 0)}"'
    touching = (
        f'type="sphere" size="{_numbers(build.radius + overlap(prototype) / 2)}"'
        if settings.wheel_shape == "sphere"
        else f'type="cylinder" size="{cylinder}" {lying}'
    )
    yield f'<geom name="tyre_{wheel}" {touching} pos="{_numbers(*centre)}" group="3" contype="0" conaffinity="0"/>'
    yield from map(_seen, wheel_shapes(prototype, build))


def _pair(prototype: Prototype, wheel: str, build: WheelBuild, step_size: float, settings: SolverSettings) -> str:
    """Contact of a tyre with the floor: two directions of friction."""
    grip = prototype.floor_friction * build.grip
    impedance = settings.contact_impedance
    return (
        f'<pair name="{wheel}" geom1="floor" geom2="tyre_{wheel}" condim="3" '
        f'friction="{_numbers(grip, grip, 0, 0, 0)}" solimp="{_numbers(impedance, impedance, 1e-3, 0.5, 2)}" '
        f'solreffriction="{_numbers(2 * step_size, 1)}"/>'
    )


def _couplings(built: AsBuilt, step_size: float) -> Iterator[str]:
    """Where front and rear unit of a side are coupled rigidly, the rear one turns against the front."""
    for (front, rear), coupling in zip((("fl", "rl"), ("fr", "rr")), built.couplings, strict=True):
        if coupling is None:
            yield (
                f'<joint joint1="{steering_joint(rear)}" joint2="{steering_joint(front)}" polycoef="0 -1 0 0 0" '
                f"{_hard(step_size)}/>"
            )


def quarter_weight(prototype: Prototype) -> float:
    """Load on one wheel of a vehicle at rest on level ground [N]."""
    return prototype.truth["m_ch"] * GRAVITY / 4


def overlap(prototype: Prototype) -> float:
    """Of a tyre and the floor under a quarter of the weight [m]."""
    return quarter_weight(prototype) / prototype.tyre.stiffness

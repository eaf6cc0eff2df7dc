"""Masses and inertias of chassis, knuckles and wheels, derived so that the totals are the truth exactly.

The paper's parameters are totals: m_ch holds the steering units, C_ch + C_l + C_r is the whole yaw inertia
about the centre, C_l the yaw inertia of both units of the left side about their steering axes, B_w the spin
inertia of a wheel with gear and motor. The engine wants one mass and inertia for each body.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from ident.errors import DataFileError
from ident.vehicle.geometry import Geometry
from ident.vehicle.parameters import Parameters

WHEEL_TRANSVERSE_RATIO: Final = 0.51
"""Transverse over spin inertia of a wheel. At 0.5 it is a flat disc; below, the engine silently zeroes the
whole tensor because it breaks the triangle inequality."""

KNUCKLE_TRANSVERSE_RATIO: Final = 0.6
"""Roll and pitch inertia of a knuckle over its yaw inertia; the planar motion does not see it."""


@dataclass(frozen=True)
class RigidBody:
    """Mass [kg], centre of mass in the frame of the body's joint [m], inertias about it on the axes [kg m^2]."""

    mass: float
    centre: tuple[float, float, float]
    inertia: tuple[float, float, float]


@dataclass(frozen=True)
class RigidBodies:
    """The chassis, the four knuckles (in wheel order fl, rl, fr, rr) and the wheel (four alike)."""

    chassis: RigidBody
    knuckles: tuple[RigidBody, RigidBody, RigidBody, RigidBody]
    wheel: RigidBody


def derive_rigid_bodies(
    geometry: Geometry,
    truth: Parameters,
    body_size: tuple[float, float, float],
    path: Path,
    *,
    wheel_mass: float,
    knuckle_mass: float,
) -> RigidBodies:
    """Split the total masses and inertias onto the bodies.

    A knuckle is counterweighted so that knuckle and wheel together balance on the steering axis: then turning
    the wheels moves no mass, and the total yaw inertia does not depend on the steering angles.

    Args:
        geometry: lengths of the vehicle.
        truth: the totals.
        body_size: length, width, height of the chassis [m], for its roll and pitch inertia.
        path: file named in errors.
        wheel_mass, knuckle_mass: of one wheel and one knuckle [kg].

    Raises:
        DataFileError: a body would get a negative mass or an inertia that no mass distribution has.
    """
    spin = truth["B_w"]
    transverse = WHEEL_TRANSVERSE_RATIO * spin
    wheel = RigidBody(wheel_mass, (0.0, 0.0, 0.0), (transverse, spin, transverse))
    left, right = (
        _knuckle(geometry, truth[symbol], side, transverse, wheel_mass, knuckle_mass)
        for symbol, side in (("C_l", 1.0), ("C_r", -1.0))
    )
    bodies = RigidBodies(
        _chassis(geometry, truth, body_size, wheel_mass + knuckle_mass), (left, left, right, right), wheel
    )
    _check(bodies, path)
    return bodies


def _knuckle(
    geometry: Geometry, yaw_of_side: float, side: float, transverse: float, wheel_mass: float, mass: float
) -> RigidBody:
    """Knuckle of one side: half of the side's yaw inertia less the wheel's share and the counterweight's."""
    offset = geometry.wheel_offset
    counterweight = wheel_mass * offset / mass
    yaw = yaw_of_side / 2 - transverse - wheel_mass * offset**2 - mass * counterweight**2
    lying = KNUCKLE_TRANSVERSE_RATIO * yaw
    return RigidBody(mass, (0.0, -side * counterweight, 0.0), (lying, lying, yaw))


def _chassis(geometry: Geometry, truth: Parameters, size: tuple[float, float, float], unit_mass: float) -> RigidBody:
    """Chassis: total less the four units, which count as point masses on their steering axes."""
    length, width, height = size
    mass = truth["m_ch"] - 4 * unit_mass
    corner_squared = (geometry.wheelbase**2 + geometry.track_width**2) / 4
    yaw = truth["C_ch"] - 4 * unit_mass * corner_squared
    roll = mass * (width**2 + height**2) / 12
    pitch = mass * (length**2 + height**2) / 12
    return RigidBody(mass, (0.0, 0.0, 0.0), (roll, pitch, yaw))


def _check(bodies: RigidBodies, path: Path) -> None:
    named = {
        "chassis": bodies.chassis,
        "left knuckle": bodies.knuckles[0],
        "right knuckle": bodies.knuckles[2],
    }
    for name, body in named.items():
        if body.mass <= 0:
            raise DataFileError(
                f"{path}: the {name} would weigh {body.mass:.3f} kg.",
                "The wheels and knuckles of [units] must weigh less than the total truth.m_ch.",
            )
        if min(body.inertia) <= 0 or 2 * max(body.inertia) >= sum(body.inertia):
            inertia = ", ".join(f"{value:.4f}" for value in body.inertia)
            raise DataFileError(
                f"{path}: the {name} would have the inertias ({inertia}) kg m^2, which no body has.",
                "Make wheels and knuckles in [units] lighter, B_w smaller, or the yaw inertia in [truth] "
                "fit the size of the body.",
            )

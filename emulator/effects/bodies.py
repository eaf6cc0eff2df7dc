"""Effects that are other masses and inertias: changed parameters, payload, centre of mass, heavy wheel units."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Final

from emulator.prototype import Prototype
from emulator.rigid_bodies import RigidBody, derive_rigid_bodies
from ident.errors import UserError
from ident.vehicle.parameters import Parameters

FLAT: Final = 0.51
"""Inertia of a payload about either horizontal axis over that about the vertical one; a flat load has 0.5."""


def change_parameter(prototype: Prototype, symbol: str, change: float) -> Prototype:
    """The same vehicle with one of its eleven parameters multiplied by 1 + change.

    Raises:
        UserError: no body has that parameter.
    """
    truth = prototype.truth.replaced(**{symbol: prototype.truth[symbol] * (1 + change)})
    if min(truth.values) < 0:
        raise UserError(f"parameter_change@{symbol}: {symbol} would be negative.", "Give a change above -1.")
    bodies, body = prototype.rigid_bodies, prototype.body
    # Roll and pitch inertia follow the yaw inertia, or the chassis would be no body; the plane motion sees neither.
    spread = math.sqrt(_radius_squared(truth) / _radius_squared(prototype.truth))
    derived = derive_rigid_bodies(
        prototype.geometry,
        truth,
        (body.length * spread, body.width * spread, body.height),
        Path(f"parameter_change@{symbol}"),
        wheel_mass=bodies.wheel.mass,
        knuckle_mass=bodies.knuckles[0].mass,
    )
    return replace(prototype, truth=truth, rigid_bodies=derived)


def _radius_squared(truth: Parameters) -> float:
    return truth["C_ch"] / truth["m_ch"]


def load_payload(prototype: Prototype, mass: float, inertia: float) -> Prototype:
    """A load fixed on the chassis over its centre, at the height of its centre of mass.

    Args:
        prototype: the vehicle without it.
        mass: [kg].
        inertia: about the vertical axis [kg m^2].
    """
    if mass < 0 or inertia < 0:
        raise UserError("payload@chassis: a load cannot be negative.", "Give a positive mass and inertia.")
    chassis = prototype.rigid_bodies.chassis
    roll, pitch, yaw = chassis.inertia
    together = chassis.mass + mass
    # About the common centre both masses turn, the further apart the more.
    ahead, left, _ = chassis.centre
    apart = chassis.mass * mass / together
    spread = (
        roll + FLAT * inertia + apart * left**2,
        pitch + FLAT * inertia + apart * ahead**2,
        yaw + inertia + apart * (ahead**2 + left**2),
    )
    share = chassis.mass / together
    return _with_chassis(prototype, RigidBody(together, (share * ahead, share * left, chassis.centre[2]), spread))


def shift_centre(prototype: Prototype, x: float, y: float) -> Prototype:
    """The vehicle's centre of mass moved to (x, y) [m] from its centre; the yaw inertia about it stays.

    Raises:
        UserError: the shift is beyond the wheels.
    """
    chassis = prototype.rigid_bodies.chassis
    lever = prototype.truth["m_ch"] / chassis.mass
    centre = (lever * x, lever * y, 0.0)
    roll, pitch, yaw = chassis.inertia
    # The chassis goes further out than the vehicle's centre of mass, so it spreads less about its own.
    own_yaw = yaw + prototype.truth["m_ch"] * (x**2 + y**2) - chassis.mass * (centre[0] ** 2 + centre[1] ** 2)
    geometry = prototype.geometry
    if abs(x) >= geometry.wheelbase / 2 or abs(y) >= geometry.track_width / 2 or own_yaw <= abs(roll - pitch):
        raise UserError(
            f"com_offset@chassis: with its mass at ({x:.2f}, {y:.2f}) m the vehicle would tip over.",
            f"Stay within {geometry.wheelbase / 2:.2f} m and {geometry.track_width / 2:.2f} m.",
        )
    return _with_chassis(prototype, RigidBody(chassis.mass, centre, (roll, pitch, own_yaw)))


def make_wheels_heavy(prototype: Prototype, mass: float) -> Prototype:
    """Mass from the chassis to the four wheels, where no counterweight balances it.

    The mass of the vehicle and its yaw inertia with the wheels on their steering axes stay; the steering units
    gain mass times a^2 about their axes.

    Args:
        prototype: the balanced vehicle.
        mass: of each wheel unit at the wheel [kg].

    Raises:
        UserError: the chassis would be left without mass.
    """
    bodies, geometry = prototype.rigid_bodies, prototype.geometry
    chassis = bodies.chassis
    corner_squared = (geometry.wheelbase**2 + geometry.track_width**2) / 4
    roll, pitch, yaw = chassis.inertia
    lighter, less = chassis.mass - 4 * mass, yaw - 4 * mass * corner_squared
    if mass < 0 or lighter <= 0 or less <= abs(roll - pitch):
        raise UserError(
            f"steering_unit_mass@chassis: four units of {mass:g} kg do not fit this vehicle.", "Give a smaller mass."
        )
    wheel = replace(bodies.wheel, mass=bodies.wheel.mass + mass)
    moved = replace(bodies, chassis=RigidBody(lighter, chassis.centre, (roll, pitch, less)), wheel=wheel)
    return replace(prototype, rigid_bodies=moved)


def _with_chassis(prototype: Prototype, chassis: RigidBody) -> Prototype:
    return replace(prototype, rigid_bodies=replace(prototype.rigid_bodies, chassis=chassis))

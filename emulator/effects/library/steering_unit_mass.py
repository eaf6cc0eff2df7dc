"""Wheel units that no counterweight balances about their steering axes."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from emulator.effects.base import Injector, Placed
from emulator.effects.injection import Injection
from emulator.effects.places import CHASSIS
from emulator.prototype import Prototype
from emulator.rigid_bodies import RigidBody
from ident.errors import UserError


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


def _inject(injection: Injection, effect: Placed) -> Injection:
    return injection.with_prototype(make_wheels_heavy(injection.built.prototype, effect["mass"]))


INJECTOR: Final = Injector(
    name="steering_unit_mass",
    places=CHASSIS,
    units={"mass": "kg"},
    inject=_inject,
)

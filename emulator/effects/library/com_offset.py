"""A vehicle whose centre of mass is not its centre."""

from __future__ import annotations

from typing import Final

from emulator.effects.base import Injector, Placed
from emulator.effects.bodies import with_chassis
from emulator.effects.injection import Injection
from emulator.effects.places import CHASSIS
from emulator.prototype import Prototype
from emulator.rigid_bodies import RigidBody
from ident.errors import UserError


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
    return with_chassis(prototype, RigidBody(chassis.mass, centre, (roll, pitch, own_yaw)))


def _inject(injection: Injection, effect: Placed) -> Injection:
    return injection.with_prototype(shift_centre(injection.built.prototype, effect["x"], effect["y"]))


INJECTOR: Final = Injector(
    name="com_offset",
    places=CHASSIS,
    units={"x": "m", "y": "m"},
    inject=_inject,
    signed=True,
)

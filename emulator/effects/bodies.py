"""Masses and inertias changed: a load on the chassis, another chassis."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from emulator.prototype import Prototype
from emulator.rigid_bodies import RigidBody
from ident.errors import UserError

FLAT: Final = 0.51
"""Inertia of a payload about either horizontal axis over that about the vertical one; a flat load has 0.5."""


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
    return with_chassis(prototype, RigidBody(together, (share * ahead, share * left, chassis.centre[2]), spread))


def with_chassis(prototype: Prototype, chassis: RigidBody) -> Prototype:
    """The vehicle with another chassis."""
    return replace(prototype, rigid_bodies=replace(prototype.rigid_bodies, chassis=chassis))

"""A prototype with other parameters: its masses and inertias derived anew, all else as it was."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

from emulator.prototype import Prototype
from emulator.rigid_bodies import derive_rigid_bodies
from ident.vehicle.parameters import Parameters


def with_truth(prototype: Prototype, truth: Parameters, source: Path) -> Prototype:
    """The same vehicle with these parameters.

    Roll and pitch inertia of the chassis follow the yaw inertia, or it would be no body; the plane motion sees neither.

    Args:
        prototype: gives geometry, units, tyres, drives, encoders, noise.
        truth: all eleven parameters.
        source: where they come from, for errors.

    Raises:
        DataFileError: no bodies have them.
    """
    bodies, body = prototype.rigid_bodies, prototype.body
    spread = math.sqrt(max(_radius_squared(truth) / _radius_squared(prototype.truth), 0.0))
    derived = derive_rigid_bodies(
        prototype.geometry,
        truth,
        (body.length * spread, body.width * spread, body.height),
        source,
        wheel_mass=bodies.wheel.mass,
        knuckle_mass=bodies.knuckles[0].mass,
    )
    return replace(prototype, truth=truth, rigid_bodies=derived)


def _radius_squared(truth: Parameters) -> float:
    return truth["C_ch"] / truth["m_ch"]

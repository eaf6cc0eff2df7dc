"""A vehicle with one of its eleven parameters changed."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Final

from emulator.effects.base import Injector, Placed
from emulator.effects.injection import Injection
from emulator.prototype import Prototype
from emulator.rigid_bodies import derive_rigid_bodies
from ident.errors import UserError
from ident.vehicle.parameters import PARAMETER_NAMES, Parameters


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


def _inject(injection: Injection, effect: Placed) -> Injection:
    return injection.with_prototype(change_parameter(injection.built.prototype, effect.where, effect["change"]))


INJECTOR: Final = Injector(
    name="parameter_change",
    places=PARAMETER_NAMES,
    units={"change": "1"},
    inject=_inject,
    signed=True,
    first=True,
)

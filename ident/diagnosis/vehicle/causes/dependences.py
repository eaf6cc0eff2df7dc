"""On what the remainder of the vehicle may depend: the motion of its joints, each and all equals, and its own speed.

A torque f at a joint j stands in the generalized rows as H_k(α)ᵀ e_j f, as friction does in (14); so does a force
against the forward speed of the chassis. A radius that is larger by f stands in the rolling rows as the motion of its
wheel does, by its rate.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.dependence import Basis, Dependence, Partner, Variable, path_since_reversal
from ident.diagnosis.problem import Channel
from ident.diagnosis.vehicle.causes.coarse import Coarse
from ident.diagnosis.vehicle.causes.context import Context
from ident.diagnosis.vehicle.records.inputs import SLICES
from ident.diagnosis.vehicle.records.sources import DRY, Source
from ident.plant import kinematics
from ident.plant.kinematics import GENERALIZED_VELOCITIES
from ident.plant.places import CHASSIS, STEERING, WHEEL_PLACES, rows_of
from ident.vehicle.geometry import WHEELS, Geometry

Array = NDArray[np.float64]

JOINTS: Final = (*STEERING, "steering", *WHEEL_PLACES, "wheels")

FIRST_JOINT: Final = 3
"""Row of q of the first joint; the six joints are the two steering axes and the four wheels."""

FORWARD: Final = len(STEERING) + len(WHEEL_PLACES)
"""Number of the chassis' way ahead, behind those of the joints."""


@dataclass(frozen=True)
class _Law:
    """A variable of joints, and what the function of it is multiplied with.

    Attributes:
        variable, partner: which.
        unit: of the variable.
        places: where it is tried.
        turn: of what it comes around with, `wheel` or `motor`; empty where it does not.
    """

    variable: Variable
    partner: Partner
    unit: str
    places: tuple[str, ...]
    turn: str = ""


_WHEELS: Final = (*WHEEL_PLACES, "wheels")
_UNITS: Final = {
    Partner.NOTHING: "Nm",
    Partner.DIRECTION: "Nm",
    Partner.RATE: "Nm s/rad",
    Partner.ACCELERATION: "kg m^2",
    Partner.ROLLING: "m",
}
_STEERING: Final = (*STEERING, "steering")
_LAWS: Final = (
    _Law(Variable.RATE, Partner.NOTHING, "rad/s", JOINTS),
    _Law(Variable.RATE, Partner.NOTHING, "m/s", CHASSIS),
    *(_Law(Variable.ANGLE, partner, "rad", _STEERING) for partner in Partner if partner is not Partner.ROLLING),
    *(_Law(Variable.ANGLE, Partner.NOTHING, "rad", _WHEELS, turn) for turn in ("wheel", "motor")),
    *(_Law(Variable.ANGLE, Partner.DIRECTION, "rad", _WHEELS, turn) for turn in ("wheel",)),
    _Law(Variable.PATH_SINCE_REVERSAL, Partner.DIRECTION, "rad", JOINTS),
    _Law(Variable.TIME, Partner.DIRECTION, "s", JOINTS),
    _Law(Variable.RATE, Partner.ROLLING, "rad/s", _WHEELS),
    _Law(Variable.ANGLE, Partner.ROLLING, "rad", _WHEELS, "wheel"),
)


def vehicle_dependences(sources: Sequence[Source], context: Context) -> list[Dependence]:
    """Every variable that is tried for the joints of the vehicle, with what the function is multiplied with."""
    torques = [levers_of(source, context) for source in sources]
    radii = [rolling_levers_of(source, context) for source in sources]
    coarse = [Coarse(source, context.processing.cutoff) for source in sources]
    return [
        _dependence(law, where, coarse, radii if law.partner is Partner.ROLLING else torques, context)
        for law in _LAWS
        for where in law.places
    ]


def _dependence(
    law: _Law, where: str, coarse: Sequence[Coarse], levers: Sequence[Array | None], context: Context
) -> Dependence:
    sources = [each.source for each in coarse]
    joints = [FORWARD] if where in CHASSIS else [row - FIRST_JOINT for row in rows_of(where)]

    def design(basis: Basis, *, apart: bool = False) -> Sequence[Array | None]:
        found: list[Array | None] = []
        for each, lever in zip(coarse, levers, strict=True):
            source = each.source
            columns: list[Array | None] = [None] * len(source.coordinates)
            rows = _acting(lever, joints)
            if lever is not None and rows:
                inputs = context.inputs(source)
                variables = [_variable(inputs, joint, law, source.time, context.geometry) for joint in joints]
                functions = [
                    (_partner(inputs, joint, law.partner) * lever[:, joint].T, basis(x))
                    for joint, x in zip(joints, variables, strict=True)
                ]
                for row in rows:
                    parts = [(factors[row], function) for factors, function in functions]
                    made = np.hstack([each.rows([part]) for part in parts]) if apart else each.rows(parts)
                    columns[row] = made if made.any() else None
            found += columns
        return found

    arguments: list[Array | None] = []
    for source, lever in zip(sources, levers, strict=True):
        of_rows: list[Array | None] = [None] * len(source.coordinates)
        for row in _acting(lever, joints):
            inputs = context.inputs(source)
            x = [_variable(inputs, joint, law, source.time, context.geometry)[:: source.factor] for joint in joints]
            of_rows[row] = np.stack(x, axis=1)
        arguments += of_rows
    turn = {"": 0.0, "wheel": 2 * math.pi, "motor": 2 * math.pi / context.geometry.gear_ratio}[law.turn]
    return Dependence(
        where=where,
        variable=law.variable,
        partner=law.partner,
        unit_x=law.unit,
        unit_y="N" if where in CHASSIS else _UNITS[law.partner],
        arguments=tuple(arguments),
        design=design,
        of=law.turn,
        period=turn,
    )


def _acting(lever: Array | None, joints: Sequence[int]) -> list[int]:
    """Rows of a source in which a torque at some joints is anything."""
    return [] if lever is None else np.flatnonzero(lever[:, joints].any(axis=(0, 1))).tolist()


def levers_of(source: Source, context: Context) -> Array | None:
    """What a torque at each joint, and a force ahead, is in the rows of a source (M, 7, rows); None: nothing.

    Where the equation of a row does not hold, it is nothing there.
    """
    if source.channel is not Channel.DYNAMIC or source.own is not None:
        return None
    inputs, spec = context.inputs(source), source.spec
    if spec.mode is None:
        found = np.zeros((len(inputs), FORWARD + 1, len(source.coordinates)))
        for row, name in enumerate(source.coordinates):
            found[:, 2 + WHEELS.index(name.removeprefix("beta_")), row] = source.holds[:, row]
        return found
    names = GENERALIZED_VELOCITIES[spec.mode]
    columns = [names.index(name) for name in source.coordinates]
    complement = kinematics.complement(spec.mode, inputs[:, SLICES["alpha"]], context.geometry)
    rows = [*range(FIRST_JOINT, FIRST_JOINT + FORWARD), 0]
    return np.asarray(complement[:, rows][:, :, columns] * source.holds[:, None, :])


def rolling_levers_of(source: Source, context: Context) -> Array | None:
    """What a larger radius of each wheel is in the rolling rows of a source (M, 7, rows) [1/s]; None: nothing."""
    if source.channel is not Channel.KINEMATIC or source.own is not None:
        return None
    inputs = context.inputs(source)
    found = np.zeros((len(inputs), FORWARD + 1, len(source.coordinates)))
    rolled = context.formulas.rolled(source.spec)(inputs, *context.constants[:2])
    found[:, len(STEERING) : FORWARD] = rolled.transpose(0, 2, 1)
    return found


def _joint(inputs: Array, joint: int, steering: str, wheel: str) -> Array:
    """A signal (M,) of a joint."""
    name, index = (steering, joint) if joint < 2 else (wheel, joint - 2)
    return inputs[:, SLICES[name].start + index]


def _variable(inputs: Array, joint: int, law: _Law, time: Array, geometry: Geometry) -> Array:
    if joint == FORWARD:
        alpha, steering, wheels = (inputs[:, SLICES[name]] for name in ("alpha", "alpha_rate", "beta_rate"))
        return kinematics.odometry(alpha, steering, wheels, geometry)[:, 0]
    rate = _joint(inputs, joint, "alpha_rate", "beta_rate")
    match law.variable:
        case Variable.RATE:
            return rate
        case Variable.TIME:
            return time
        case Variable.PATH_SINCE_REVERSAL:
            return path_since_reversal(_joint(inputs, joint, "alpha", "beta"), rate)
        case _:
            return _joint(inputs, joint, "alpha", "beta")


def _partner(inputs: Array, joint: int, partner: Partner) -> Array | float:
    match partner:
        case Partner.DIRECTION:
            return np.tanh(_joint(inputs, joint, "alpha_rate", "beta_rate") / DRY)
        case Partner.RATE:
            return _joint(inputs, joint, "alpha_rate", "beta_rate")
        case Partner.ACCELERATION:
            return _joint(inputs, joint, "alpha_acceleration", "beta_acceleration")
        case _:
            return 1.0

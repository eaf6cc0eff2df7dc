"""Laws that no library has, drawn for an exam: place, variable, and a shape from a random smooth process.

How far the function reaches, where its coefficients stand and how fast it changes are drawn as well, so that the
diagnosis tries none of what was injected. Its size is what the parameters of the model leave of it, in noise units.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from hil.exam.cases import Injected
from hil.exam.sizes import SizeTable
from hil.exam.smooth import draw_length, smooth_values
from ident.diagnosis.law.spline import Knots
from ident.diagnosis.observations.linear import least_squares, rms
from ident.effects import Effect, make_effect
from ident.effects.laws import COUNT, coefficient
from ident.plant.places import STEERING, WHEEL_PLACES, rows_of
from ident.records.record import Record

Array = NDArray[np.float64]

MEASURE: Final = "asymmetric_coulomb"
"""The effect whose size says how many Nm are a noise unit at a joint: it pushes with its size wherever that moves."""

DRAWN: Final = 24
"""Points of a shape, which are the coefficients of a spline; a law has them on half of the step."""

SLACK: Final = 0.5
"""Largest share of the range by which the coefficients reach beyond it, on either side."""

MOVING: Final = 0.02
"""Part of its largest rate from which a joint counts as moving."""

_LAWS: Final[Mapping[str, tuple[str, ...]]] = {
    "law_rate": (*STEERING, "steering", *WHEEL_PLACES, "wheels"),
    "law_angle": (*STEERING, *WHEEL_PLACES),
    "law_angle_direction": (*STEERING, "steering"),
    "law_angle_rate": STEERING,
}


@dataclass(frozen=True)
class Joint:
    """Motion of a joint in the steps of a plan, moving samples alone: angle [rad], rate [rad/s], acceleration."""

    angle: Array
    rate: Array
    acceleration: Array


def draw_laws(table: SizeTable, sizes: Sequence[float], generator: np.random.Generator) -> list[Injected]:
    """Laws in turn over names, places drawn; the size of each is in noise units.

    Args:
        table: of the world.
        sizes: of the laws.
        generator: of everything else.
    """
    names = list(_LAWS)
    return [
        _drawn(
            names[index % len(names)], str(generator.choice(_LAWS[names[index % len(names)]])), size, table, generator
        )
        for index, size in enumerate(sizes)
    ]


def _drawn(name: str, where: str, size: float, table: SizeTable, generator: np.random.Generator) -> Injected:
    row = next(row for row in table.visible if (row.name, row.where) == (MEASURE, where))
    length = draw_length(generator)
    before, behind = generator.uniform(0.0, SLACK, size=2).tolist()
    numbers = {"unit": row.physical(1.0), "before": before, "behind": behind}
    periodic = name == "law_angle" and where in WHEEL_PLACES
    shape = _smooth(length if periodic else length / (1 + before + behind), periodic, generator)
    coefficients = {coefficient(index): round(float(value), 5) for index, value in enumerate(shape)}
    return Injected(name, where, "scale", size, numbers | coefficients)


def _smooth(length: float, periodic: bool, generator: np.random.Generator) -> Array:
    """(DRAWN,) of a Gaussian process of unit variance over [0, 1]."""
    distance = np.subtract.outer(np.arange(DRAWN), np.arange(DRAWN)) / (DRAWN if periodic else DRAWN - 3)
    if periodic:
        distance = np.sin(np.pi * distance) / np.pi
    return smooth_values(distance, length, generator)


def law_effect(injected: Injected, planned: Record) -> Effect:
    """The law as a vehicle has it that drives a plan.

    Args:
        injected: as drawn.
        planned: what the plan drives.
    """
    numbers = dict(injected.values)
    unit, before, behind = (numbers.pop(name) for name in ("unit", "before", "behind"))
    joints = [_joint(planned, row - 3) for row in rows_of(injected.where)]
    periodic = injected.name == "law_angle" and injected.where in WHEEL_PLACES
    variables = [joint.rate if injected.name == "law_rate" else joint.angle for joint in joints]
    if periodic:
        period, start, step = 2 * math.pi, 0.0, math.pi / DRAWN
    else:
        low, high = min(x.min() for x in variables), max(x.max() for x in variables)
        reach = high - low
        period, step = 0.0, reach * (1 + before + behind) / (DRAWN - 3) / 2
        start = low - before * reach - step
    values = {"scale": 1.0, "start": start, "step": step, "period": period}
    points = np.array([numbers[coefficient(index)] for index in range(DRAWN)])
    numbers = {coefficient(index): value for index, value in enumerate(_halved(points, periodic).tolist())}
    law = make_effect(injected.name, injected.where, values | numbers)
    left = [_left(law, joint, x) for joint, x in zip(joints, variables, strict=True)]
    scale = injected.size * unit / max(rms(np.concatenate(left)), np.finfo(float).tiny)
    return make_effect(injected.name, injected.where, values | {"scale": scale} | numbers)


def _halved(points: Array, periodic: bool) -> Array:
    """Coefficients (COUNT,) on half of the step, of the spline that has those (DRAWN,) on the whole one.

    The curve is the same (Lane and Riesenfeld 1980); beyond a range it goes over to the value at its end.
    """
    before, behind = np.roll(points, 1), np.roll(points, -1)
    on, between = (before + 6 * points + behind) / 8, (points + behind) / 2
    fine = np.column_stack([on, between]).ravel()
    if periodic:
        return fine
    fine = fine[1 : 2 * DRAWN - 2]
    last = (fine[-3] + 4 * fine[-2] + fine[-1]) / 6
    return np.append(fine, np.full(COUNT - len(fine), last))


def _joint(planned: Record, joint: int) -> Joint:
    """Motion of one of the six joints where it moves."""
    parts = []
    for segment in planned.segments:
        angle = segment.steering_angles[:, joint] if joint < 2 else segment.wheel_angles[:, joint - 2]
        rate = np.gradient(angle, segment.sample_time)
        parts.append(np.stack([angle, rate, np.gradient(rate, segment.sample_time)]))
    angle, rate, acceleration = np.hstack(parts)
    moving = np.abs(rate) > MOVING * np.abs(rate).max()
    return Joint(angle[moving], rate[moving], acceleration[moving])


def _left(law: Effect, joint: Joint, x: Array) -> Array:
    """What friction and inertia of the model leave of a law [Nm], its scale being one."""
    basis = Knots(law["start"], law["step"], law["period"]).basis(x)
    torque = basis @ np.array([law[coefficient(index)] for index in range(COUNT)])
    partner = {"law_angle_direction": np.sign(joint.rate), "law_angle_rate": joint.rate}.get(law.name, 1.0)
    absorbed = np.stack([np.sign(joint.rate), joint.rate, joint.acceleration], axis=1)
    series = torque * partner
    return np.asarray(series - absorbed @ least_squares(absorbed, series))

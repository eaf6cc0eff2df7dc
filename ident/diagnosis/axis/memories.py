"""Possible causes that remember: friction after a reversal, with the load and with time, and a drive that follows."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.axis.model import AxisEffect, AxisModel, linear, shaped_by
from ident.diagnosis.dependence import path_since_reversal
from ident.diagnosis.names import EffectName
from ident.diagnosis.observations.delays import HELD, RARER, led
from ident.diagnosis.observations.tried import tried_between
from ident.diagnosis.problem import Candidate, Variant
from ident.effects import EffectParameter
from ident.estimate.filters import SEVEN, differentiate

Array = NDArray[np.float64]

START: Final = 0.1
"""Part of a record over which friction warms up at least: faster is a start, no warming."""

FURTHEST: Final = 3.0
"""Durations of a record over which it warms up at most: what is slower has one shape."""


def presliding(axis: AxisModel) -> Candidate:
    """Bristles that bend before they slide (Dahl 1968): beyond the friction in motion, exp(-s/d) over the path s."""
    direction = np.sign(axis.motion.velocity)
    path = path_since_reversal(axis.motion.position, axis.motion.velocity)
    shortest, longest = axis.nearest, axis.reach

    def series(distance: float) -> Array:
        within = np.clip(abs(distance), shortest, longest)
        return np.asarray(direction * np.exp(-path / within))

    parameters = (
        EffectParameter("amplitude", axis.unit(), "friction right after a reversal beyond that in motion"),
        EffectParameter("distance", axis.kind.position_unit, "path over which it has fallen to 1/e", positive=True),
    )
    tried = tried_between(shortest, longest)
    candidate = shaped_by(axis, EffectName.PRESLIDING, parameters, series, tried, price=math.log(len(tried)))
    return replace(candidate, lowest=(0.0, shortest))


def friction_load(axis: AxisModel) -> Candidate:
    """Dry friction that grows with the load, as that of screws and of worm gears."""
    parameter = EffectParameter("share", "1", "of the load that resists as dry friction")
    return linear(axis, EffectName.FRICTION_LOAD, [parameter], np.abs(axis.effort) * np.sign(axis.motion.velocity))


def friction_warming(axis: AxisModel) -> Candidate:
    """Dry friction that comes to change as the axis warms up, by 1 - exp(-t/T)."""
    time = np.arange(len(axis.effort)) * axis.sample_time
    direction = np.sign(axis.motion.velocity)
    shortest, longest = START * float(time[-1]), FURTHEST * float(time[-1])

    def series(constant: float) -> Array:
        within = np.clip(abs(constant), shortest, longest)
        return np.asarray(direction * (1 - np.exp(-time / within)))

    parameters = (
        EffectParameter("change", axis.unit(), "of the Coulomb friction, once warm"),
        EffectParameter("time", "s", "in which 63 % of the change have come", positive=True),
    )
    tried = tried_between(shortest, longest)
    return shaped_by(axis, AxisEffect.FRICTION_WARMING, parameters, series, tried, price=math.log(len(tried)))


def torque_filter(axis: AxisModel) -> Candidate:
    """A drive whose effort follows what is reported as a filter of first order does."""

    contribution, turned = axis.answered(lambda values, effort: led(effort, float(values[0]), axis.sample_time))
    slope = differentiate(axis.effort, axis.sample_time, SEVEN)
    parameters = (
        EffectParameter("time", "s", "constant of the filter between the effort reported and the one that acts"),
    )
    variants = (Variant(axis.alone(slope[:, None])),)
    shortest = HELD * axis.sample_time
    return Candidate(
        EffectName.TORQUE_FILTER,
        axis.place,
        parameters,
        variants,
        contribution,
        turned=turned,
        least=0.0,
        negligible=(shortest, shortest),
        price=RARER,
    )

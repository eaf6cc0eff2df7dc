"""Possible causes that depend on where an axis is: friction, inertia and load over its position, or that of a sum."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.axis.model import AxisEffect, AxisModel, linear
from ident.diagnosis.names import EffectName
from ident.diagnosis.problem import Candidate
from ident.effects import EffectParameter
from ident.records.axis_record import AxisKind

Array = NDArray[np.float64]


def friction_position(axis: AxisModel) -> Candidate:
    """Dry friction that grows along the travel, as where guides are not parallel or a belt is tighter."""
    parameter = EffectParameter("slope", axis.unit("/q"), "of the Coulomb friction over the position")
    return linear(axis, EffectName.FRICTION_POSITION, [parameter], _centred(axis) * np.sign(axis.motion.velocity))


def inertia_position(axis: AxisModel) -> Candidate:
    """Inertia that changes along the travel; of a rotary axis, over its angle as that of a linkage does."""
    acceleration = axis.motion.acceleration
    if axis.kind is AxisKind.LINEAR:
        parameter = EffectParameter("slope", "kg/m", "of the inertia over the position")
        return linear(axis, AxisEffect.INERTIA_POSITION, [parameter], _centred(axis) * acceleration)
    parameters = [
        EffectParameter("sine", "kg m^2", "inertia, times the sine of the angle"),
        EffectParameter("cosine", "kg m^2", "inertia, times the cosine of the angle"),
    ]
    position = axis.motion.position
    columns = (np.sin(position) * acceleration, np.cos(position) * acceleration)
    return linear(axis, AxisEffect.INERTIA_POSITION, parameters, *columns)


def gravity_loads(axis: AxisModel) -> Iterator[Candidate]:
    """A load over the position: of a linear axis a spring or counterweight, of joints gravity over sums of angles."""
    own = axis.motion.position
    if axis.kind is AxisKind.LINEAR:
        parameter = EffectParameter("slope", "N/m", "of the load over the position")
        yield linear(axis, AxisEffect.GRAVITY_LOAD, [parameter], _centred(axis))
        return
    parameters = [
        EffectParameter("sine", "Nm", "moment, times the sine of the angle"),
        EffectParameter("cosine", "Nm", "moment, times the cosine of the angle"),
    ]
    for name, other in axis.others:
        for word, angle in (("+", own + other.position), ("-", own - other.position), ("", other.position)):
            columns = (np.sin(angle), np.cos(angle))
            yield linear(axis, AxisEffect.GRAVITY_LOAD, parameters, *columns, where=f"{axis.place}<{word}{name}")


def _centred(axis: AxisModel) -> Array:
    position = axis.motion.position
    return np.asarray(position - (position.max() + position.min()) / 2)

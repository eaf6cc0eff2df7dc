"""On what the remainder of an axis may depend: its own motion and load, time, and the motion of the other axes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.axis.model import AxisModel
from ident.diagnosis.dependence import Basis, Dependence, Partner, Variable, path_since_reversal
from ident.estimate.filters import SEVEN, differentiate

Array = NDArray[np.float64]


def axis_dependences(axis: AxisModel) -> list[Dependence]:
    """Every variable that is tried for an axis, with what the function is multiplied with."""
    motion, dt = axis.motion, axis.sample_time
    position, effort = axis.kind.position_unit, axis.kind.effort_unit
    load_rate = differentiate(axis.effort, dt, SEVEN)
    nothing, direction = Partner.NOTHING, Partner.DIRECTION
    time = np.arange(len(axis.effort)) * dt
    own = [
        (Variable.RATE, nothing, motion.velocity, f"{position}/s"),
        (Variable.ANGLE, nothing, motion.position, position),
        (Variable.ANGLE, direction, motion.position, position),
        (Variable.ANGLE, Partner.ACCELERATION, motion.position, position),
        (Variable.ANGLE, Partner.RATE, motion.position, position),
        (Variable.LOAD, nothing, axis.effort, effort),
        (Variable.LOAD, direction, np.abs(axis.effort), effort),
        (Variable.LOAD_RATE, nothing, load_rate, f"{effort}/s"),
        (Variable.LOAD_SECOND_RATE, nothing, differentiate(load_rate, dt, SEVEN), f"{effort}/s^2"),
        (Variable.TIME, nothing, time, "s"),
        (Variable.TIME, direction, time, "s"),
        (Variable.PATH_SINCE_REVERSAL, direction, path_since_reversal(motion.position, motion.velocity), position),
    ]
    return [_dependence(axis, *entry) for entry in own] + list(_of_others(axis))


def _of_others(axis: AxisModel) -> Iterator[Dependence]:
    """Of each other axis, and of both together: forces along sums of angles are gravity, of rates a shared shaft."""
    own, unit = axis.motion, axis.kind.position_unit
    for name, other in axis.others:
        yield _dependence(axis, Variable.OTHER_AXIS, Partner.NOTHING, other.velocity, f"{unit}/s", f"rate_{name}")
        for sign, word in ((1, "plus"), (-1, "minus")):
            angle, rate = own.position + sign * other.position, own.velocity + sign * other.velocity
            yield _dependence(axis, Variable.OTHER_AXIS, Partner.NOTHING, angle, unit, f"angle_{word}_{name}")
            yield _dependence(axis, Variable.OTHER_AXIS, Partner.NOTHING, rate, f"{unit}/s", f"rate_{word}_{name}")
        yield _dependence(axis, Variable.OTHER_AXIS, Partner.NOTHING, other.position, unit, f"angle_{name}")


def _dependence(axis: AxisModel, variable: Variable, partner: Partner, x: Array, unit: str, of: str = "") -> Dependence:
    factor = _partner(axis, partner)

    # An axis has no equals: apart or together is the same.
    def design(basis: Basis, *, apart: bool = False) -> Sequence[Array | None]:
        columns = basis(x)
        return axis.alone(columns if factor is None else factor[:, None] * columns)

    arguments = tuple(x[:, None] if block == axis.block else None for block in range(axis.blocks))
    return Dependence(
        where=axis.place,
        variable=variable,
        partner=partner,
        unit_x=unit,
        unit_y=axis.unit(_PER[partner]),
        arguments=arguments,
        design=design,
        of=of,
        unrecorded=_unrecorded(axis, variable, partner),
    )


def _unrecorded(axis: AxisModel, variable: Variable, partner: Partner) -> Variable | None:
    """What else moves while a single axis does, as the other joints of an arm, is some function of time."""
    is_time = variable is Variable.TIME and partner is Partner.NOTHING
    return Variable.OTHER_AXIS if is_time and not axis.others else None


_PER = {Partner.NOTHING: "", Partner.DIRECTION: "", Partner.RATE: " s/q", Partner.ACCELERATION: " s^2/q"}


def _partner(axis: AxisModel, partner: Partner) -> Array | None:
    motion = axis.motion
    series = {
        Partner.DIRECTION: np.sign(motion.velocity),
        Partner.RATE: motion.velocity,
        Partner.ACCELERATION: motion.acceleration,
    }
    return series.get(partner)

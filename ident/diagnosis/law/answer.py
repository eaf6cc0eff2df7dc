"""A law as people and programs read it: its curve, a formula where a short one does as well, and its nearest name."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.dependence import Dependence, law_name
from ident.diagnosis.diagnosis import Alternative, LawAnswer
from ident.diagnosis.law.formula import formula_of
from ident.diagnosis.law.law import Law
from ident.diagnosis.observations.rows import Column
from ident.diagnosis.problem import Problem
from ident.effects import Effect, make_effect
from ident.effects.laws import COUNT, LAWS, coefficient

Array = NDArray[np.float64]

POINTS: Final = 2 * (COUNT - 3) + 1
"""Of a curve: two for every step between its knots."""


def curve_of(law: Law) -> Array:
    """(POINTS, 3) variable, function and its standard deviation over the range that the records have shown."""
    knots = law.learnt.knots
    x = np.linspace(0.0, knots.period, POINTS) if knots.period else np.linspace(*knots.ends, POINTS)
    basis = knots.basis(x)
    covariance = basis @ law.learnt.covariance @ basis.T
    return np.stack([x, basis @ law.learnt.whole, np.sqrt(np.maximum(np.diag(covariance), 0.0))], axis=1)


def law_answer(law: Law, channel: str, nearest: tuple[str, float] | None, unrecorded: str | None = None) -> LawAnswer:
    """What a law says.

    Args:
        law: as it was learnt.
        channel: of its rows.
        nearest: key of the nearest effect of the library, and the cosine of what both add.
        unrecorded: of what else that the records do not have it may be a function.
    """
    dependence, knots = law.dependence, law.learnt.knots
    curve = curve_of(law)
    x, y, std = curve.T
    return LawAnswer(
        variable=str(dependence.variable),
        partner=str(dependence.partner),
        of=dependence.of,
        channel=channel,
        period=knots.period or None,
        unit_x=dependence.unit_x,
        unit_y=dependence.unit_y,
        curve=curve,
        formula=formula_of(x, y, std, knots.period),
        nearest=None if nearest is None else nearest[0],
        distance=None if nearest is None else math.sqrt(max(1 - nearest[1] ** 2, 0.0)),
        unrecorded=unrecorded,
    )


def channel_of(problem: Problem, column: Column) -> str:
    """Of the rows in which a variant acts."""
    series = problem.candidates[column.candidate].variants[column.variant].columns
    return str(next(block.channel for block, one in zip(problem.blocks, series, strict=True) if one is not None))


def same_laws(
    keys: Sequence[str], dependences: Sequence[Dependence], unrecorded: str | None = None
) -> tuple[Alternative, ...]:
    """The laws of another variable, or elsewhere, that add the same to these records as the first of them does.

    Args:
        keys: of those that are recorded.
        dependences: of the records.
        unrecorded: the variable of one that is not.
    """
    by_key = {one.key: one for one in dependences}
    own, *others = (by_key[key] for key in keys)
    found = dict.fromkeys((str(other.variable), other.where) for other in others)
    found.pop((str(own.variable), own.where), None)
    if unrecorded is not None:
        found[unrecorded, own.where] = None
    return tuple(Alternative(None, variable, where) for variable, where in found)


def unrecorded_variable(law: Law, problems: Sequence[Problem]) -> str | None:
    """Of what that is not recorded a law may be, which no other record than those fitted to confirms.

    Args:
        law: as it was learnt.
        problems: to fit and to confirm.
    """
    fitted, confirming = ({block.record for block in problem.blocks} for problem in problems)
    variable = law.dependence.unrecorded
    return None if variable is None or not confirming <= fitted else str(variable)


def same_names(keys: Sequence[str]) -> tuple[Alternative, ...]:
    """The effects that these records do not tell from the first of them."""
    pairs = (key.split("@", 1) for key in keys[1:])
    return tuple(Alternative(name, None, where) for name, where in pairs)


def law_effect(law: Law, scale: float, std: float) -> Effect | None:
    """The law as an effect of a model; None where a model has no form for it.

    Args:
        law: as it was learnt.
        scale, std: of it, by the refit.
    """
    name = law_name(law.dependence.variable, law.dependence.partner)
    if name not in LAWS or law.dependence.where not in LAWS[name].places:
        return None
    knots = law.learnt.knots
    coefficients = {coefficient(index): value for index, value in enumerate(law.learnt.weights.tolist())}
    values = {"scale": scale, "start": knots.start, "step": knots.step, "period": knots.period}
    return make_effect(name, law.dependence.where, values | coefficients, {"scale": std})

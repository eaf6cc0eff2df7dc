"""What a cause adds to the rows, exactly, for numbers of its own and of the model."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.problem import Variant
from ident.diagnosis.vehicle.bending import BristleCause
from ident.diagnosis.vehicle.context import Context
from ident.diagnosis.vehicle.library import TermCause
from ident.diagnosis.vehicle.sliding import SlidingCause
from ident.diagnosis.vehicle.sources import Source
from ident.diagnosis.vehicle.transforms import TransformCause
from ident.vehicle.parameters import PARAMETER_NAMES

Array = NDArray[np.float64]
Cause = TermCause | TransformCause | BristleCause | SlidingCause


def contribution_of(
    cause: Cause, acting: Sequence[bool], sources: Sequence[Source], context: Context
) -> Callable[[Array, Array], Sequence[Array | None]]:
    """What the cause adds to every block, exactly, for numbers of its own and of the baseline, the model's in front."""

    def contribution(values: Array, parameters: Array) -> list[Array | None]:
        found: list[Array | None] = []
        signals, changed = np.zeros(0), None
        for source, acts in zip(sources, acting, strict=True):
            # Both channels of a segment have the same signals: what takes the effect out of them is done once.
            if acts and not isinstance(cause, TermCause) and source.inputs is not signals:
                signals = source.inputs
                changed = cause.without(context.inputs(source), values, context.setting(source))
            change = _change(cause, source, context, values, parameters, changed) if acts else None
            if change is None:
                found += [None] * len(source.coordinates)
                continue
            columns = context.filtered(change, source).T
            found += [column if np.any(column) else None for column in columns]
        return found

    return contribution


def _change(
    cause: Cause, source: Source, context: Context, values: Array, parameters: Array, changed: Array | None
) -> Array | None:
    """The same for one source before the filter (M, rows); None where it is zero.

    `changed` are its signals with the effect taken out; None for effects that stand in the equations.
    """
    context = replace(context, parameters=parameters[: len(PARAMETER_NAMES)])
    inputs = context.inputs(source)
    if changed is not None:
        seen = _seen(source, context)
        if np.array_equal(changed[:, seen], inputs[:, seen]):
            return None
        after = context.rows_of(changed, source)
    elif source.own is not None:
        return None
    else:
        exact = context.formulas.exact(source.channel, source.spec, cause.name, cause.where)
        after = exact(inputs, *context.constants, values)
    return np.asarray((after - context.plain(source))[..., 0])


def _seen(source: Source, context: Context) -> list[int]:
    """Columns of the signals that the rows of a source are made of."""
    if source.own is not None:
        return list(source.own.columns)
    plain = context.formulas.exact(source.channel, source.spec)
    return [element for argument, element in plain.inputs if argument == 0]


def acting_in(variants: Sequence[Variant], sources: Sequence[Source]) -> list[bool]:
    """Whether any column of a cause acts in any row of each source."""
    acting, end = [], 0
    for source in sources:
        blocks = slice(end, end + len(source.coordinates))
        acting.append(any(column is not None for variant in variants for column in variant.columns[blocks]))
        end = blocks.stop
    return acting


def side_by_side(columns: Sequence[Array | None]) -> Array | None:
    """Columns (N,) as one array, None for zeros; None where all are."""
    there = [column for column in columns if column is not None]
    if not there:
        return None
    return np.stack([np.zeros_like(there[0]) if column is None else column for column in columns], axis=1)

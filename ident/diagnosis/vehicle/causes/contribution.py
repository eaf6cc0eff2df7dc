"""What a cause adds to the rows, exactly, for numbers of its own and of the model."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.problem import Variant
from ident.diagnosis.vehicle.causes.bending import BristleCause
from ident.diagnosis.vehicle.causes.context import Context
from ident.diagnosis.vehicle.causes.library import TermCause
from ident.diagnosis.vehicle.records.sliding import SlidingCause
from ident.diagnosis.vehicle.records.sources import Source
from ident.diagnosis.vehicle.records.transforms import Setting, TransformCause
from ident.plant.prepared import Prepared
from ident.vehicle.parameters import PARAMETER_NAMES

Array = NDArray[np.float64]
Cause = TermCause | TransformCause | BristleCause | SlidingCause


class InSignals(Protocol):
    """What is taken out of the recorded signals."""

    def without(self, inputs: Array, sizes: Array, setting: Setting) -> Array:
        """Signals (N, INPUTS) as they were without it, of numbers of its own."""


def contribution_of(
    cause: TermCause | InSignals, acting: Sequence[bool], sources: Sequence[Source], context: Context
) -> Callable[[Array, Array], Sequence[Array | None]]:
    """What the cause adds to every block, exactly, for numbers of its own and of the baseline, the model's in front."""
    if isinstance(cause, TermCause):
        return _term_contribution(cause, acting, sources, context)

    def contribution(values: Array, parameters: Array) -> list[Array | None]:
        found: list[Array | None] = []
        signals, changed = np.zeros(0), None
        for source, acts in zip(sources, acting, strict=True):
            # Both channels of a segment have the same signals: what takes the effect out of them is done once.
            if acts and source.inputs is not signals:
                signals = source.inputs
                changed = cause.without(context.inputs(source), values, context.setting(source))
            change = _change(source, context, parameters, changed) if changed is not None and acts else None
            if change is None:
                found += [None] * len(source.coordinates)
                continue
            found += _columns(change, range(len(source.coordinates)), source, context)
        return found

    return contribution


def _change(source: Source, context: Context, parameters: Array, changed: Array) -> Array | None:
    """What it adds to one source before the filter (M, rows), whose signals are `changed` without it; None: nothing."""
    context = replace(context, parameters=parameters[: len(PARAMETER_NAMES)])
    inputs = context.inputs(source)
    if all(np.array_equal(changed[:, column], inputs[:, column]) for column in _seen(source, context)):
        return None
    return np.asarray((context.rows_of(changed, source) - context.plain(source))[..., 0])


def _term_contribution(
    cause: TermCause, acting: Sequence[bool], sources: Sequence[Source], context: Context
) -> Callable[[Array, Array], Sequence[Array | None]]:
    """The same of an effect that stands in the equations: all that is not its own is computed once."""
    kept: dict[int, tuple[bytes, Prepared]] = {}

    def prepared(number: int, source: Source, parameters: Array) -> Prepared:
        asked, known = parameters.tobytes(), kept.get(number)
        if known is None or known[0] != asked:
            exact = context.formulas.exact(source.channel, source.spec, cause.name, cause.where)
            constants = replace(context, parameters=parameters).constants
            known = kept[number] = asked, Prepared(exact, context.inputs(source), *constants)
        return known[1]

    def contribution(values: Array, parameters: Array) -> list[Array | None]:
        found: list[Array | None] = []
        for number, (source, acts) in enumerate(zip(sources, acting, strict=True)):
            if not acts or source.own is not None:
                found += [None] * len(source.coordinates)
                continue
            asked = parameters[: len(PARAMETER_NAMES)]
            rows, exact = prepared(number, source, asked), replace(context, parameters=asked)
            # Entries are rows: these functions have one column, and no structural zeros (`Formulas.exact`).
            touched = list(rows.touched)
            change = rows.entries(values) - exact.plain(source)[:, touched, 0].T
            found += _columns(change.T, touched, source, context)
        return found

    return contribution


def _columns(change: Array, rows: Sequence[int], source: Source, context: Context) -> list[Array | None]:
    """Every row of a source, filtered, of the change (M, k) of some of them; None where it is zero."""
    found: list[Array | None] = [None] * len(source.coordinates)
    for row, column in zip(rows, context.in_rows(change, source, rows).T, strict=True):
        found[row] = column if np.any(column) else None
    return found


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

"""A record of the platform as a regression: blocks of the dynamic and the kinematic channel, columns of every cause."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from ident.diagnosis.names import EffectName, refuse_strangers
from ident.diagnosis.observations.linear import rms
from ident.diagnosis.problem import Block, Channel, Nominal, Problem
from ident.diagnosis.vehicle.causes.candidates import candidate_of, causes_of, seen_together, slid_by_any
from ident.diagnosis.vehicle.causes.context import Context, fitted_parameters, make_context, table_of
from ident.diagnosis.vehicle.causes.creep import (
    CREEP_NAMES,
    CREEP_STD,
    creep_columns,
    tolerated_creep,
    tolerated_over_time,
)
from ident.diagnosis.vehicle.causes.dependences import vehicle_dependences
from ident.diagnosis.vehicle.causes.lag import LAG_NAME, LAG_STD, lag_columns, stated_lag
from ident.diagnosis.vehicle.causes.library import TermCause
from ident.diagnosis.vehicle.records.inputs import SLICES
from ident.diagnosis.vehicle.records.moments import apart_from_moments
from ident.diagnosis.vehicle.records.rattling import SHAKEN
from ident.diagnosis.vehicle.records.regions import coordinate_motion, features_of, regions_of
from ident.diagnosis.vehicle.records.rows import MODEL_COLUMNS
from ident.diagnosis.vehicle.records.sources import DIAGNOSED, Source, processing_of, sources_of
from ident.effects import EFFECTS, Effect
from ident.estimate.filters import Processing
from ident.records.record import Record, Step
from ident.vehicle.description import VehicleDescription
from ident.vehicle.lag import Lag
from ident.vehicle.parameters import PARAMETER_NAMES, PARAMETER_UNITS, Parameters

Array = NDArray[np.float64]

UNSTATED: Final[Mapping[str, tuple[float, float]]] = MappingProxyType(
    dict.fromkeys(CREEP_NAMES, (0.0, CREEP_STD)) | {LAG_NAME: (0.0, LAG_STD)}
)
"""Means and standard deviations of what is fitted beside the parameters and is no cause."""


def build_problem(
    records: Sequence[Record],
    vehicle: VehicleDescription,
    model: Parameters | None = None,
    *,
    lag: Lag | None = None,
    given: Sequence[Effect] = (),
    effects: Sequence[EffectName] = tuple(EffectName),
    steps: Sequence[Step] = DIAGNOSED,
    processing: Processing | None = None,
    obeyed: bool = False,
) -> Problem:
    """Rows and causes of some records.

    Args:
        records: of campaigns with this vehicle as it is.
        vehicle: its geometry is taken as true, its prior only for what no row shows.
        model: values being judged; None: they are refitted, and changed values are no cause.
        lag: of the torques, by the model; None: not known.
        given: effects that the model has already.
        effects: that are looked for.
        steps: whose rows are used, variants of them included.
        processing: filters and thresholds; None: those of the estimate, signals as fast as the records allow.
        obeyed: whether the records are known to obey the model; else torques are asked for as the rows would have them.

    Raises:
        RecordError: none of the steps is in a record.
        UserError: the model has an effect that the diagnosis does not know.
    """
    refuse_strangers(given)
    processing = processing or processing_of(records)
    lengths = vehicle.geometry
    found = [sources_of(record, lengths, steps, processing) for record in records]
    sources = [source for each in found for source in apart_from_moments(each, lengths, processing)]
    context = replace(make_context(sources, vehicle, model, given, processing), lag=stated_lag(lag, sources))
    if model and not obeyed and EffectName.TORQUE_GAIN in effects:
        context = replace(context, asked=fitted_parameters(sources, vehicle, context))
    causes = causes_of(tuple(effects), model is not None)
    units = [unit for cause in causes if isinstance(cause, TermCause) for unit in cause.units]
    tables = [table_of(source, context, units) for source in sources]
    blocks = [block for source, table in zip(sources, tables, strict=True) for block in _blocks(source, table, context)]
    columns = iter(range(MODEL_COLUMNS, MODEL_COLUMNS + len(units)))
    candidates = [
        replace(found, usual=abs(EFFECTS[found.effect].usual(vehicle, found.where)))
        for found in (candidate_of(cause, columns, sources, tables, context) for cause in causes)
    ]
    beside = zip(creep_columns(sources, context), lag_columns(sources, context), strict=True)
    slid = slid_by_any(sources, context)
    return Problem(
        names=(*PARAMETER_NAMES, *UNSTATED),
        units=(*PARAMETER_UNITS.values(), *["1"] * len(CREEP_NAMES), "samples"),
        blocks=tuple(
            replace(block, irregular=series, baseline=np.column_stack([block.baseline, *columns]))
            for block, series, columns in zip(blocks, slid, beside, strict=True)
        ),
        candidates=tuple(seen_together(candidates, sources, tables, context)),
        nominal=_nominal(model, context.lag) if model else None,
        spreads=UNSTATED,
        dependences=tuple(vehicle_dependences(sources, context)),
    )


def _nominal(model: Parameters, lag: Lag | None) -> Nominal:
    """Values of the model, whose wheels do not creep; lag in samples."""
    unstated = dict(UNSTATED)
    if lag is not None:
        unstated[LAG_NAME] = lag.value / lag.interval, lag.std / lag.interval
    values, std = zip(*unstated.values(), strict=True)
    return Nominal(
        np.append(model.values, values),
        np.append(model.std, std),
        None if model.correlation is None else block_diag(model.correlation, np.eye(len(UNSTATED))),
    )


def _blocks(source: Source, table: Array, context: Context) -> Iterable[Block]:
    """One block a coordinate; the target is what baseline and causes add up to."""
    rolls = source.channel is Channel.KINEMATIC and source.own is None
    tolerated = tolerated_over_time(source) if rolls else None
    for row, name in enumerate(source.coordinates):
        motion = coordinate_motion(source.inputs, source.spec, name, context.geometry)
        position, rate, acceleration = (values[:: source.factor] for values in motion)
        target = -table[:, row, 0]
        load = context.filtered(np.abs(source.inputs[:, SLICES["torques"]]).sum(axis=1), source)
        yield Block(
            record=source.record,
            channel=source.channel,
            step=source.step,
            coordinate=name,
            unit=_unit(source, name),
            sample_time=source.sample_time * source.factor,
            bandwidth=context.processing.cutoff,
            target=target,
            baseline=table[:, row, 1:MODEL_COLUMNS],
            moving=source.moving[row][:: source.factor],
            period=source.period[:: source.factor],
            regions=regions_of(position, rate, acceleration, load),
            features=features_of(position, rate, acceleration, load),
            tolerance=_tolerance(source, row, target, context),
            tolerated=tolerated,
        )


def _tolerance(source: Source, row: int, target: Array, context: Context) -> float:
    """What a row may lack for reasons that no cause has, rms in its unit."""
    used = source.moving[row][:: source.factor]
    if source.own is not None:
        size = rms(context.filtered(source.own.of(source.inputs)[:, row], source)[used])
        return math.hypot(source.own.untold * size, source.own.lever * source.own.other)
    if source.channel is Channel.DYNAMIC:
        return SHAKEN * rms(target[used]) if source.travels and source.rattles.any() else 0.0
    return tolerated_creep(source, source.coordinates[row], context.geometry)


def _unit(source: Source, coordinate: str) -> str:
    if source.channel is Channel.KINEMATIC:
        return "m/s" if source.own is None else "m"
    return "N" if coordinate in ("x", "y") else "Nm"

"""Records of servo axes as commands take them: identified, or with the model that a diagnosis has made of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from ident.axis_file import AxisEffectEntry, AxisModelEntry, write_axis_models
from ident.diagnosis.answer.findings import Cause, Findings
from ident.estimate.axis import AxisIdentification, identify_axis
from ident.estimate.axis.processing import PARAMETERS, AxisProcessing, processing_for
from ident.records.axis_record import AxisKind, AxisRecord, read_axis_record
from ident.vehicle.quantities import Quantity
from ident.writing import refuse_folder, refuse_inputs

AXIS_FILE: Final = "axis.toml"

ASSUMED: Final = {
    AxisKind.LINEAR: "No units are stated, m and N are taken; name a channel `position [rad]` if its axis turns.",
    AxisKind.ROTARY: "No units are stated, rad and Nm are taken; name a channel `position [m]` if its axis slides.",
}
"""What is said where the kind of an axis is assumed."""


@dataclass(frozen=True)
class AxisResult:
    """Axes of one record, identified.

    Attributes:
        record: as read.
        processing: by which it became equations.
        axes: one identification each.
        notes: what the reader must know, a line each.
    """

    record: AxisRecord
    processing: AxisProcessing
    axes: tuple[AxisIdentification, ...]
    notes: tuple[str, ...]


def identify_axis_record(path: Path, out: Path, cutoff: float | None = None) -> AxisResult:
    """Identify every axis of a record, each by itself; nothing is written yet.

    Args:
        path: CSV, Parquet, MF4 or the MATLAB file of EMPS.
        out: folder for `axis.toml`.
        cutoff: of the position filter [Hz]; None: from the record.

    Raises:
        UserError: the record cannot be used, or the file would stand in its place.
    """
    refuse_folder(out / AXIS_FILE)
    refuse_inputs([out / AXIS_FILE], [path])
    record = read_axis_record(path)
    processing = processing_for(record, None if cutoff is None else 2 * math.pi * cutoff)
    axes = tuple(identify_axis(record, processing, axis.name) for axis in record.axes)
    return AxisResult(record, processing, axes, assumed_kinds([record]))


def assumed_kinds(records: Sequence[AxisRecord]) -> tuple[str, ...]:
    """What is said of records whose files state no units."""
    kinds = [axis.kind for record in records for axis in record.axes if axis.assumed]
    return (ASSUMED[kinds[0]],) if kinds else ()


def write_axis_result(result: AxisResult, path: Path, out: Path) -> Path:
    """Write `axis.toml` into a folder, which is made where it is missing.

    Args:
        result: to write.
        path: of the record, for its source.
        out: folder.

    Raises:
        UserError: it cannot be written.
    """
    source = f"least squares, {path.name}"
    models = [
        AxisModelEntry(
            result.record.axis(found.axis).named("axis"),
            {one.name: Quantity(one.value, one.unit, source, one.std) for one in found.estimates},
        )
        for found in result.axes
    ]
    write_axis_models(models, out / AXIS_FILE, {"run": "identification", "records": path.name})
    return out / AXIS_FILE


def axis_models(findings: Findings, axes: Sequence[str]) -> list[AxisModelEntry]:
    """The models of some axes with the effects that a diagnosis has named, parameters refitted beside them.

    Args:
        findings: of a diagnosis of axes.
        axes: their places, `axis` or `axis_1`, ...
    """
    names, fitted = findings.problem.names, findings.after
    values = dict(
        zip(names, zip(fitted.baseline, fitted.baseline_std, findings.problem.units, strict=True), strict=True)
    )
    found = []
    for place in axes:
        suffix = place.removeprefix("axis")
        parameters = {}
        for name in PARAMETERS:
            value, std, unit = values[f"{name}{suffix}"]
            parameters[name] = Quantity(float(value), unit, "diagnosis", float(std))
        own = [_effect(cause) for cause in findings.causes if cause.candidate.where.split("<")[0] == place]
        found.append(AxisModelEntry(place, parameters, own))
    return found


def _effect(cause: Cause) -> AxisEffectEntry:
    curve = [] if cause.law_answer is None else cause.law_answer.curve.tolist()
    return AxisEffectEntry(str(cause.candidate.effect), cause.candidate.where, cause.quantities, curve)

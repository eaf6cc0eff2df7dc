"""Diagnoses records of the platform or of axes as they are asked for, and writes the answer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from hil.campaign.asked import DiagnosisOrder, asked_again, asked_of_run
from hil.campaign.axes import assumed_kinds, axis_models
from hil.campaign.folder import describe, sources_of
from hil.campaign.reading import first_run, read_of, whole_records
from hil.network.described import told_differences
from ident.axis_file import AxisModelEntry, write_axis_models
from ident.diagnosis.answer.findings import Findings
from ident.diagnosis.axis.diagnose import diagnose_axis
from ident.diagnosis.diagnosis import Diagnosis, faulty, write_diagnosis
from ident.diagnosis.vehicle.closing import extended_model
from ident.diagnosis.vehicle.diagnose import diagnose_vehicle
from ident.diagnosis.vehicle.unseen import unseen_gaps
from ident.effects.extended import ExtendedModel
from ident.errors import RecordError, UserError
from ident.faults import sure_faults
from ident.parameters_file import read_model, write_model
from ident.records.axis_record import AxisRecord, read_axis_record
from ident.records.record import Record
from ident.report.commands import Asked
from ident.report.faults import fault_lines, write_fault_report
from ident.report.gap import GapReport, write_gap_report
from ident.report.gap_summary import summary_lines
from ident.stages import Stage, untold
from ident.vehicle.description import find_data_file
from ident.vehicle.geometry import Geometry
from ident.writing import refuse_folder, refuse_inputs

Array = NDArray[np.float64]

SAME: Final = 1e-6
"""Largest difference of two series over their range at which they are the same recording, written twice."""
SAME_RATE: Final = 0.01
"""Largest relative difference of two sample times."""


@dataclass(frozen=True)
class Answer:
    """What was found.

    Attributes:
        findings: None where the records have faults, and were not looked into further.
        diagnosis: as it goes into `diagnosis.json`.
        model: with the effects that are named; None where none is.
        notes: what the reader must know, a line each.
        geometry: of the vehicle that was diagnosed; None for axes.
        axes: models of axes with the effects that are named; empty for a vehicle, or where none is.
        asked: what commands that come next need; None for records at fault.
    """

    findings: Findings | None
    diagnosis: Diagnosis
    model: ExtendedModel | None = None
    notes: tuple[str, ...] = ()
    geometry: Geometry | None = None
    axes: tuple[AxisModelEntry, ...] = ()
    asked: Asked | None = None

    @property
    def summary(self) -> list[str]:
        """Ten lines for people, and the notes."""
        if self.findings is None:
            return [*fault_lines(self.diagnosis.faults), *self.notes]
        return [*summary_lines(self.findings, self.diagnosis), *self.notes]


@dataclass(frozen=True)
class _Stretch:
    """One uninterrupted recording, for comparison with others.

    Attributes:
        source: for messages.
        sample_time: [s].
        series: (N, n) what was measured.
    """

    source: str
    sample_time: float
    series: Array

    def is_same(self, other: _Stretch) -> bool:
        """Whether the samples are the same, whatever the file is called and when its time begins."""
        if self.series.shape != other.series.shape:
            return False
        reach = np.maximum(np.ptp(self.series, axis=0), np.finfo(float).tiny)
        return bool(np.all(np.abs(self.series - other.series) <= SAME * reach))


def diagnose_records(order: DiagnosisOrder, stage: Stage = untold) -> Answer:
    """Diagnose; nothing is written yet.

    Raises:
        UserError: a record, the model or the vehicle cannot be used, a file cannot be written, or a record is to
            confirm itself.
    """
    _refuse_unworkable(order)
    return _axis_answer(order, stage) if order.axis else _vehicle_answer(order, stage)


def write_answer(order: DiagnosisOrder, answer: Answer) -> list[Path]:
    """Write the files that were asked for, each whole; no model where no effect is named. Gives their paths.

    Raises:
        UserError: one cannot be written.
    """
    fitted, confirmed = (tuple(map(str, paths)) for paths in (order.records, order.confirm))
    judged = None if order.model is None else str(order.model)
    written = []
    if order.json is not None:
        write_diagnosis(answer.diagnosis, order.json)
        written.append(order.json)
    if order.report is not None:
        if answer.findings is None:
            write_fault_report(answer.diagnosis.faults, (*fitted, *confirmed), order.report)
        else:
            content = GapReport(
                answer.findings,
                answer.diagnosis,
                fitted,
                confirmed,
                judged,
                asked=answer.asked,
                geometry=answer.geometry,
            )
            write_gap_report(content, order.report)
        written.append(order.report)
    if order.extended is not None and answer.model is not None:
        write_model(answer.model, order.extended, _provenance(order), geometry=answer.geometry)
        written.append(order.extended)
    if order.extended is not None and answer.axes:
        write_axis_models(answer.axes, order.extended, _provenance(order))
        written.append(order.extended)
    return written


def _provenance(order: DiagnosisOrder) -> dict[str, str]:
    """What the numbers of the model come from: names of the records, and of the model under test."""
    sources = {"run": "diagnosis", "records": _names(order.records)}
    if order.confirm:
        sources["confirm"] = _names(order.confirm)
    if order.model is not None:
        sources["model"] = order.model.name
    return sources


def _names(paths: Sequence[Path]) -> str:
    return ", ".join(path.name for path in paths)


def _refuse_unworkable(order: DiagnosisOrder) -> None:
    """Refuse what could not be diagnosed or written, before the work.

    Raises:
        UserError: a name is that of a folder or of a file that is read, there is no such model, or it was assessed as
            unusable.
    """
    if order.model is not None and not order.axis:
        # What is written would be a model without an assessment, so force does not reach so far.
        force = order.force and order.extended is None
        read_model(order.model, force=force)
    for path in order.files:
        refuse_folder(path)
    read = [source for path in (*order.records, *order.confirm) for source in sources_of(path)]
    vehicle = None if order.vehicle is None or order.axis else find_data_file("ident.vehicle", order.vehicle)
    refuse_inputs(order.files, [*read, order.model, vehicle])


def _axis_answer(order: DiagnosisOrder, stage: Stage) -> Answer:
    if order.model is not None or order.vehicle is not None:
        raise UserError(
            "--model and --vehicle are of the platform, --axis says that the records are of servo axes.",
            "Leave one side out; the model of an axis is refitted from its records.",
        )
    stage("reading")
    records, confirming = ([read_axis_record(path) for path in paths] for paths in (order.records, order.confirm))
    _refuse_repeated([_of_axes(record) for record in (*records, *confirming)], same_rate=False)
    findings = diagnose_axis(records, confirming, seed=order.seed, stage=stage)
    diagnosis = findings.diagnosis()
    places = [axis.named("axis") for axis in records[0].axes]
    axes = axis_models(findings, places) if diagnosis.verdict.explains else []
    return Answer(findings, diagnosis, notes=assumed_kinds(records), axes=tuple(axes), asked=asked_again(order))


def _vehicle_answer(order: DiagnosisOrder, stage: Stage) -> Answer:
    first = first_run(order.records)
    described = describe(first, order.vehicle, order.network)
    vehicle = described.vehicle
    told = "" if first is None else told_differences(vehicle, first.plan.vehicle)
    model = None if order.model is None else read_model(order.model)
    stage("reading")
    records, confirming = (
        [read_of(path, order.vehicle, order.network, described) for path in paths]
        for paths in (order.records, order.confirm)
    )
    _refuse_repeated([part for record in (*records, *confirming) for part in _of_vehicle(record)], same_rate=True)
    stage("looking for faults of the records")
    faults = sure_faults(whole_records((*records, *confirming)), vehicle)
    notes = (told,) if told else ()
    if faults:
        return Answer(None, faulty(faults), notes=notes)
    found = diagnose_vehicle(records, confirming, vehicle, model, seed=order.seed, stage=stage)
    given, lag = (model.effects, model.lag) if model is not None else ((), None)
    stage("what the steps left out show")
    diagnosis = replace(found.diagnosis, unseen=unseen_gaps(found.findings, records, confirming, vehicle, given))
    named = diagnosis.verdict.explains
    extended = extended_model(found.findings, vehicle.prior, given=given, lag=lag) if named else None
    asked = asked_of_run(order, first, vehicle)
    return Answer(found.findings, diagnosis, extended, notes, vehicle.geometry, asked=asked)


def _refuse_repeated(parts: Sequence[_Stretch], *, same_rate: bool) -> None:
    """Refuse what is there twice, under whatever name, and recordings of different rates where they must be one.

    Raises:
        RecordError: named.
    """
    for index, part in enumerate(parts):
        for other in parts[:index]:
            if part.is_same(other):
                raise RecordError(
                    f"{part.source} holds the same samples as {other.source}.",
                    "A record cannot confirm itself, nor count twice: name independent ones, or leave it out.",
                )
            if same_rate and abs(part.sample_time - other.sample_time) > SAME_RATE * other.sample_time:
                raise RecordError(
                    f"{part.source} is sampled every {part.sample_time * 1e3:.4g} ms, {other.source} every "
                    f"{other.sample_time * 1e3:.4g} ms.",
                    "Record all of them at the same rate, or resample them to it.",
                )


def _of_axes(record: AxisRecord) -> _Stretch:
    series = [values for axis in record.axes for values in (axis.position, axis.effort)]
    return _Stretch(record.source, record.sample_time, np.stack(series, axis=1))


def _of_vehicle(record: Record) -> list[_Stretch]:
    return [
        _Stretch(
            f"{record.source}, step {segment.step}",
            segment.sample_time,
            np.hstack([segment.motor_torques, segment.wheel_angles, segment.steering_angles]),
        )
        for segment in record.segments
    ]

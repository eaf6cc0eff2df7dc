"""What `quasiomni diagnose` does: read records of the platform or of axes, diagnose them, show and write the answer."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from hil.campaign.folder import RunFolder, network_file_of, open_run
from hil.campaign.reading import read_any
from hil.network import load_network
from ident.errors import RecordError, UserError
from ident.gap.axis.diagnose import diagnose_axis
from ident.gap.diagnosis import Diagnosis, Verdict, write_diagnosis
from ident.gap.findings import Findings
from ident.gap.vehicle.closing import extended_model
from ident.gap.vehicle.diagnose import diagnose_vehicle
from ident.gap.vehicle.unseen import unseen_gaps
from ident.records.axis_record import AxisKind, AxisRecord, read_axis_record
from ident.records.record import Record
from ident.report.gap import GapReport, write_gap_report
from ident.report.gap_summary import summary_lines
from ident.vehicle.description import VehicleDescription, load_vehicle
from ident.vehicle.extended import ExtendedModel, read_model, write_model
from ident.writing import refuse_folder

Array = NDArray[np.float64]

SAME: Final = 1e-6
"""Largest difference of two series over their range at which they are the same recording, written twice."""
SAME_RATE: Final = 0.01
"""Largest relative difference of two sample times."""

ASSUMED: Final = {
    AxisKind.LINEAR: "No units are stated, m and N are taken; name a channel `position [rad]` if its axis turns.",
    AxisKind.ROTARY: "No units are stated, rad and Nm are taken; name a channel `position [m]` if its axis slides.",
}
"""What is said where the kind of an axis is assumed."""


@dataclass(frozen=True)
class DiagnosisOrder:
    """A diagnosis as it is asked for.

    Attributes:
        records: run folders or files to look for causes in.
        confirm: the same, independent of them; none: a part of `records` confirms.
        vehicle: shipped vehicle file by name, or a path; None: that of the first run folder, or the prototype.
        model: `parameters.toml` that is judged; None: the parameters are refitted.
        axis: the records are of servo axes.
        seed: of the surrogates.
        json, report, extended: files to write, or None; `extended` is the model with the effects that are named.
    """

    records: tuple[Path, ...]
    confirm: tuple[Path, ...]
    vehicle: str | None
    model: Path | None
    axis: bool
    seed: int
    json: Path | None
    report: Path | None
    extended: Path | None = None

    @property
    def files(self) -> tuple[Path, ...]:
        """What is to be written."""
        return tuple(path for path in (self.json, self.report, self.extended) if path is not None)


@dataclass(frozen=True)
class _Answer:
    findings: Findings
    diagnosis: Diagnosis
    model: ExtendedModel | None = None
    notes: tuple[str, ...] = ()


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


def diagnose_records(order: DiagnosisOrder, console: Console) -> Diagnosis:
    """Diagnose, show ten lines, and write what is asked for; files are written whole, and only with a valid answer.

    Raises:
        UserError: a record, the model or the vehicle cannot be used, or a record is to confirm itself.
    """
    _refuse_unwritable(order)
    with console.status("diagnosing"):
        answer = _axis_answer(order) if order.axis else _vehicle_answer(order)
    _say(console, [*summary_lines(answer.findings, answer.diagnosis), *answer.notes])
    written = _written(order, answer)
    if order.extended is not None and order.extended not in written:
        _say(console, [f"{order.extended} is not written: no effect is named."])
    if written:
        _say(console, [f"Written: {', '.join(map(str, written))}"])
    return answer.diagnosis


def _say(console: Console, lines: Iterable[str]) -> None:
    for line in lines:
        console.print(line, highlight=False, markup=False, soft_wrap=True)


def _written(order: DiagnosisOrder, answer: _Answer) -> list[Path]:
    """The files that were asked for, each written whole; no model where no effect is named."""
    fitted, confirmed = (tuple(map(str, paths)) for paths in (order.records, order.confirm))
    judged = None if order.model is None else str(order.model)
    written = []
    if order.json is not None:
        write_diagnosis(answer.diagnosis, order.json)
        written.append(order.json)
    if order.report is not None:
        write_gap_report(GapReport(answer.findings, answer.diagnosis, fitted, confirmed, judged), order.report)
        written.append(order.report)
    if order.extended is not None and answer.model is not None:
        write_model(answer.model, order.extended, _provenance(order))
        written.append(order.extended)
    return written


def _provenance(order: DiagnosisOrder) -> dict[str, str]:
    """What the numbers of the model come from: names of the records, and of the model that was judged."""
    sources = {"run": "diagnosis", "records": _names(order.records)}
    if order.confirm:
        sources["confirm"] = _names(order.confirm)
    if order.model is not None:
        sources["model"] = order.model.name
    return sources


def _names(paths: Sequence[Path]) -> str:
    return ", ".join(path.name for path in paths)


def _refuse_unwritable(order: DiagnosisOrder) -> None:
    """Refuse what could not be written, before the work.

    Raises:
        UserError: a name is that of a folder, or there is no such model.
    """
    for path in order.files:
        refuse_folder(path)
    if order.axis and order.extended is not None:
        raise UserError(
            "--extended writes a model of the platform, --axis says that the records are of servo axes.",
            "Leave one of them out; --json holds the causes of an axis.",
        )


def _axis_answer(order: DiagnosisOrder) -> _Answer:
    if order.model is not None or order.vehicle is not None:
        raise UserError(
            "--model and --vehicle are of the platform, --axis says that the records are of servo axes.",
            "Leave one side out; the model of an axis is refitted from its records.",
        )
    records, confirming = ([read_axis_record(path) for path in paths] for paths in (order.records, order.confirm))
    _refuse_repeated([_of_axes(record) for record in (*records, *confirming)])
    findings = diagnose_axis(records, confirming, seed=order.seed)
    assumed = [axis.kind for record in records for axis in record.axes if axis.assumed]
    return _Answer(findings, findings.diagnosis(), notes=(ASSUMED[assumed[0]],) if assumed else ())


def _vehicle_answer(order: DiagnosisOrder) -> _Answer:
    network = load_network(network_file_of(order.vehicle or "prototype"))
    vehicle = _vehicle(order)
    model = None if order.model is None else read_model(order.model)
    records, confirming = ([read_any(path, network) for path in paths] for paths in (order.records, order.confirm))
    _refuse_repeated([part for record in (*records, *confirming) for part in _of_vehicle(record)])
    found = diagnose_vehicle(records, confirming, vehicle, model, seed=order.seed)
    given = model.effects if model is not None else ()
    diagnosis = replace(found.diagnosis, unseen=unseen_gaps(found.findings, records, confirming, vehicle, given))
    named = diagnosis.verdict is Verdict.EFFECT
    extended = extended_model(found.findings, vehicle.prior, given=given) if named else None
    return _Answer(found.findings, diagnosis, extended)


def _vehicle(order: DiagnosisOrder) -> VehicleDescription:
    """The vehicle that is named, or the one of the first run folder."""
    folders = [path for path in order.records if RunFolder(path).manifest.is_file()]
    if order.vehicle is None and folders:
        return open_run(folders[0]).plan.vehicle
    return load_vehicle(order.vehicle or "prototype")


def _refuse_repeated(parts: Sequence[_Stretch]) -> None:
    """Refuse what is there twice, under whatever name, and recordings of different rates.

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
            if abs(part.sample_time - other.sample_time) > SAME_RATE * other.sample_time:
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

"""Identifies runs and records, assesses the result, and writes it with its report."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Final

from hil.campaign.folder import Run, describe, open_run, sources_of
from hil.campaign.reading import first_run, join, read_driven, read_of, read_run
from hil.network.described import told_differences
from ident.assessment import Assessment, assess
from ident.assessment.faults import blamed_on
from ident.campaign.plan import Plan
from ident.errors import EstimationError, UserError
from ident.estimate.identify import identify
from ident.estimate.result import Identification, KnownInertia
from ident.faults import find_faults
from ident.parameters_file import Identified, write_model
from ident.records.record import Record
from ident.report.html import ReportContent, write_report
from ident.stages import Stage, untold
from ident.vehicle.description import VehicleDescription
from ident.vehicle.parameters import Parameters
from ident.writing import refuse_inputs, refuse_unlike

_RESULTS: Final = {"parameters.toml": b"naive_std = ", "report.html": b"<title>Identification of "}
"""Files that an identification writes under fixed names, and what is in each of them."""

PAPER_PROTOTYPE = "prototype"
"""Name of the vehicle that Table 2 of the paper describes."""


@dataclass(frozen=True)
class Result:
    """An identification with all that its reader needs.

    Attributes:
        content: of the report: the result, its assessment, and what it comes from.
        command: that looks for the cause where the result is not good, as it is typed.
    """

    content: ReportContent
    command: str


def identify_run(
    folder: Path,
    out: Path,
    known_inertia: KnownInertia | None = None,
    truth: Parameters | None = None,
    vehicle: str | None = None,
    network: Path | None = None,
    stage: Stage = untold,
    note: Callable[[str], None] = untold,
) -> Result:
    """Identify a run from its frames; nothing is written yet.

    Args:
        folder: of the run.
        out: folder that the results will go to.
        known_inertia: B_w in place of that of the run.
        truth: shown beside the result.
        vehicle, network: files to take in place of those in the run folder; what differs is said.
        stage: called with the name of each stage.
        note: called with what differs, before the work: it may be why there is no result.

    Raises:
        UserError: the folder, a log, a file that is given, or the excitation in the logs will not do.
    """
    run = open_run(folder)
    described = describe(run, vehicle, network)
    _refuse_inputs(out, [folder, described.vehicle.path, described.network.path])
    stage("decoding the frames")
    record = read_driven(replace(run, network=described.network))
    if differences := told_differences(described.vehicle, run.plan.vehicle):
        note(differences)
    provenance = {**provenance_of(run), "vehicle": described.vehicle.name}
    return Result(
        _identified(record, described.vehicle, known_inertia or run.known_inertia, provenance, truth, run.plan, stage),
        _diagnose_command([folder], vehicle, network),
    )


def identify_records(
    paths: Sequence[Path],
    out: Path,
    known_inertia: KnownInertia | None = None,
    vehicle: str | None = None,
    network: Path | None = None,
    stage: Stage = untold,
) -> Result:
    """Identify from logs or plain records; nothing is written yet. Arguments as of `identify_run`.

    Raises:
        UserError: a file, or the excitation in it, will not do.
    """
    first = first_run(paths)
    described = describe(first, vehicle, network)
    _refuse_inputs(out, [*paths, described.vehicle.path, described.network.path])
    stage("reading")
    record = join([read_of(path, vehicle, network, described) for path in paths])
    inertia = known_inertia or (first.known_inertia if first is not None else None)
    provenance = {"run": record.source, "vehicle": described.vehicle.name, "quasiomni": version("quasiomni")}
    content = _identified(record, described.vehicle, inertia, provenance, None, None, stage)
    return Result(content, _diagnose_command(paths, vehicle, network))


def write_result(content: ReportContent, out: Path) -> tuple[Path, Path]:
    """Write `parameters.toml` and `report.html` into a folder; gives their paths.

    Raises:
        UserError: they cannot be written.
    """
    parameters, report = (out / name for name in _RESULTS)
    try:
        out.mkdir(parents=True, exist_ok=True)
        identified = Identified(content.identification, content.assessment)
        geometry = content.vehicle.geometry
        write_model(identified.model, parameters, content.provenance, identified=identified, geometry=geometry)
    except OSError as error:
        raise UserError(f"{out} cannot be written to: {error.strerror}.", "Name another folder (--out).") from error
    write_report(content, report)
    return parameters, report


def _diagnose_command(records: Sequence[Path], vehicle: str | None, network: Path | None) -> str:
    """What looks for the cause, as it is typed."""
    words = ["quasiomni", "diagnose", *map(str, records)]
    words += ["--vehicle", vehicle] if vehicle else []
    words += ["--network", str(network)] if network else []
    return shlex.join(words)


def report_run(folder: Path, target: Path, truth: Parameters | None, stage: Stage = untold) -> None:
    """Write the report of a run from its frames.

    Raises:
        UserError: the folder, a log, or the excitation in it will not do.
    """
    run = open_run(folder)
    refuse_inputs([target], sources_of(folder))
    if target == run.folder.report:
        refuse_unlike(target, _RESULTS[target.name])
    record = read_run(folder)
    provenance = provenance_of(run)
    content = _identified(record, run.plan.vehicle, run.known_inertia, provenance, truth, run.plan, stage)
    write_report(content, target)


def _refuse_inputs(out: Path, read: Sequence[Path | None]) -> None:
    written = [out / name for name in _RESULTS]
    refuse_inputs(written, [source for path in read if path is not None for source in sources_of(path)])
    for path in written:
        refuse_unlike(path, _RESULTS[path.name])


def provenance_of(run: Run) -> dict[str, str]:
    """Where a result comes from, for its files."""
    return {
        "run": run.folder.path.name,
        "vehicle": run.plan.vehicle.name,
        "bus": run.bus,
        "seed": str(run.seed),
        "quasiomni": version("quasiomni"),
    }


def _identified(
    record: Record,
    vehicle: VehicleDescription,
    inertia: KnownInertia | None,
    provenance: Mapping[str, str],
    truth: Parameters | None,
    plan: Plan | None,
    stage: Stage,
) -> ReportContent:
    """What a report shows; Table 2 of the paper only beside the vehicle that it describes."""
    stage("identifying")
    result, assessment = _assessed(record, vehicle, inertia)
    title, paper = f"Identification of {vehicle.name}", vehicle.name == PAPER_PROTOTYPE
    return ReportContent(title, result, assessment, record, vehicle, truth, plan, provenance, record.notes, paper)


def _assessed(
    record: Record, vehicle: VehicleDescription, inertia: KnownInertia | None
) -> tuple[Identification, Assessment]:
    """The result and whether it can be true.

    Raises:
        EstimationError: there is no result; with the fault of the record that is to blame, where there is one.
    """
    faults = find_faults(record, vehicle)
    try:
        result = identify(record, vehicle.geometry, known_inertia=inertia)
    except EstimationError as error:
        raise blamed_on(error, faults) from error
    return result, assess(result, record, vehicle, faults)

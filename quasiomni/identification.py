"""The commands that make parameters of what was driven."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from hil.campaign.axes import identify_axis_record, write_axis_result
from hil.campaign.folder import RunFolder, open_run
from hil.campaign.results import Result, identify_records, identify_run, report_run, write_result
from ident.assessment import Verdict
from ident.errors import UserError
from ident.estimate.result import KnownInertia
from ident.report.assessment import assessment_lines
from ident.report.tables import (
    axis_table,
    condition_line,
    excitation_table,
    lag_line,
    paper_table,
    parameter_table,
    step_table,
)
from quasiomni.application import app, console
from quasiomni.options import (
    GivenVehicleOption,
    InertiaOption,
    InertiaStdOption,
    NetworkOption,
    require_readers,
    truth_of,
)
from quasiomni.showing import say, stages


@app.command()
def identify(
    records: Annotated[
        list[Path], typer.Argument(help="Run folder, logs named NNN_step.blf, or CSV, Parquet or MF4 records.")
    ],
    vehicle: GivenVehicleOption = None,
    network: NetworkOption = None,
    b_w: InertiaOption = None,
    b_w_std: InertiaStdOption = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for parameters.toml and report.html. Default: the run folder, or here.")
    ] = None,
    axis: Annotated[
        bool, typer.Option("--axis", help="The record is of servo axes: time, position, effort. Writes axis.toml.")
    ] = False,
    cutoff: Annotated[
        float | None, typer.Option(min=1e-3, help="Of the position filter of axes [Hz]. Default: from the record.")
    ] = None,
) -> None:
    """Identify the parameters from recorded frames or records alone; writes parameters.toml and report.html.

    The result is assessed: good, doubtful (exit 0, with the command that looks for the cause), or unusable (exit 1).
    """
    require_readers(records)
    if axis:
        _refuse_platform(records, vehicle, network, b_w, b_w_std)
        _identify_axes(records[0], out or Path(), cutoff)
        return
    if cutoff is not None:
        raise UserError("--cutoff is of the position filter of axes.", "Add --axis, or leave it out.")
    inertia = known_inertia(b_w, b_w_std)
    is_run = len(records) == 1 and RunFolder(records[0]).manifest.is_file()
    target = out or (records[0] if is_run else Path())
    with stages() as stage:
        if is_run:
            result = identify_run(records[0], target, inertia, None, vehicle, network, stage, _warn)
        else:
            result = identify_records(records, target, inertia, vehicle, network, stage)
    end_with(result, target)


def _refuse_platform(records: list[Path], *options: object) -> None:
    if any(option is not None for option in options):
        raise UserError(
            "--vehicle, --network, --b-w and --b-w-std are of the platform, --axis of records of servo axes.",
            "Leave one side out.",
        )
    if len(records) > 1:
        raise UserError("Axes are identified from one record.", "Name one of them, or diagnose all with --axis.")


def _identify_axes(path: Path, out: Path, cutoff: float | None) -> None:
    with stages() as stage:
        stage("reading")
        result = identify_axis_record(path, out, cutoff)
    for found in result.axes:
        console.print(axis_table(result.record.axis(found.axis).label, found))
    hertz = result.processing.cutoff / (2 * math.pi)
    say([f"Position filter {hertz:.3g} Hz, every {result.processing.decimation}. sample a row.", *result.notes])
    written = write_axis_result(result, path, out)
    console.print(f"Written: {written}")
    say([f"What this model lacks: quasiomni diagnose {path} --axis"])


@app.command()
def report(
    run: Annotated[Path, typer.Argument(help="Run folder.")],
    out: Annotated[Path | None, typer.Option(help="File to write. Default: report.html in the run folder.")] = None,
) -> None:
    """Write the HTML report of a run again, from its frames."""
    prototype, target = open_run(run).emulated, out or RunFolder(run).report
    with stages() as stage:
        report_run(run, target, truth_of(prototype) if prototype else None, stage)
    console.print(f"Written: {target}")


def _warn(line: str) -> None:
    say([line], style="yellow")


def end_with(result: Result, out: Path) -> None:
    """Show a result and write it; exit code 1 for what cannot be true, so that a script stops there."""
    content = result.content
    identification, assessment = content.identification, content.assessment
    for line in assessment_lines(assessment, result.command):
        console.print(line, highlight=False, soft_wrap=True)
    console.print(
        parameter_table(identification, content.truth), excitation_table(identification), step_table(identification)
    )
    if content.paper:
        console.print(paper_table(identification))
    console.print(condition_line(identification))
    if (lag := lag_line(identification)) is not None:
        console.print(lag)
    for note in content.record.notes:
        console.print(note, style="yellow", markup=False)
    with console.status("writing the report"):
        parameters, report = write_result(content, out)
    console.print(f"Written: {parameters}, {report}")
    if assessment.verdict is Verdict.UNUSABLE:
        raise typer.Exit(code=1)


def known_inertia(value: float | None, std: float | None) -> KnownInertia | None:
    """B_w as it is given.

    Raises:
        UserError: one of the two is missing, or they cannot be.
    """
    if value is None:
        if std is not None:
            raise UserError("B_w's standard deviation is given without B_w.", "Add --b-w, or leave --b-w-std out.")
        return None
    if std is None:
        raise UserError("B_w is given without its standard deviation.", "Add --b-w-std: every result depends on it.")
    if not (value > 0 and 0 <= std < value):
        raise UserError(f"B_w = {value} ± {std} kg m² cannot be.", "Give a positive value and a smaller deviation.")
    return KnownInertia(value, std, "given")

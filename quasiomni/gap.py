"""The command that says why model and machine disagree."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hil.campaign.diagnosing import DiagnosisOrder, diagnose_records, write_answer
from quasiomni.application import app
from quasiomni.options import ForceOption, NetworkOption, require_readers
from quasiomni.showing import say, stages


@app.command()
def diagnose(
    records: Annotated[
        list[Path], typer.Argument(help="Run folders, logs, or CSV, Parquet or MF4 records to look for causes in.")
    ],
    confirm: Annotated[
        list[Path] | None,
        typer.Option(help="Independent record that must confirm; repeat for more. Default: held-out repeats."),
    ] = None,
    vehicle: Annotated[
        str | None, typer.Option(help="Vehicle file: `prototype`, `compact`, or the path of your own.")
    ] = None,
    network: NetworkOption = None,
    model: Annotated[
        Path | None, typer.Option(help="parameters.toml of the model under test. Default: refitted.")
    ] = None,
    axis: Annotated[
        bool, typer.Option("--axis", help="The records are of servo axes: time, position, effort.")
    ] = False,
    json: Annotated[Path | None, typer.Option(help="Write diagnosis.json here.")] = None,
    report: Annotated[Path | None, typer.Option(help="Write an HTML report here.")] = None,
    extended: Annotated[
        Path | None, typer.Option(help="Write the parameters.toml of the model with the effects named here.")
    ] = None,
    force: ForceOption = False,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the surrogates.")] = 1,
) -> None:
    """Say why model and machine disagree: which effect, where, how sure, how much it closes, what to do next."""
    given = tuple(records), tuple(confirm or ())
    require_readers((*records, *given[1]))
    order = DiagnosisOrder(*given, vehicle, model, axis, seed, json, report, extended, force, network)
    with stages("diagnosing") as stage:
        answer = diagnose_records(order, stage)
    say(answer.summary)
    written = write_answer(order, answer)
    if extended is not None and extended not in written:
        say([f"{extended} is not written: no effect is named."])
    if written:
        say([f"Written: {', '.join(map(str, written))}"])

"""The command that looks at this computer: what works here, and what is missing for the rest."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer
from rich import box
from rich.table import Table
from rich.text import Text

from hil.bench.doctor import Check, CheckName, examine
from ident.errors import UserError
from quasiomni.application import app, console
from quasiomni.options import PriorityOption
from quasiomni.real_time import try_real_time


@app.command()
def doctor(
    checks: Annotated[list[CheckName] | None, typer.Argument(help="What must be there. Default: everything.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON in place of a table.")] = False,
    real_time: Annotated[
        float | None,
        typer.Option(
            "--real-time",
            min=1.0,
            help="Measure instead how late cycles are here, and why: so many seconds of a loop that only sleeps, and "
            "as many of the emulated vehicle in real time.",
        ),
    ] = None,
    trace: Annotated[
        Path | None, typer.Option(help="With --real-time: write the late cycles here, instant by instant, as CSV.")
    ] = None,
    priority: PriorityOption = True,
) -> None:
    """What is installed here, and what is missing for what. Exit code 1 if something is, or cycles are too late."""
    if real_time is not None:
        if not try_real_time(real_time, trace, priority=priority, as_json=as_json):
            raise typer.Exit(1)
        return
    if trace is not None or not priority:
        raise UserError("--trace and --no-priority are of --real-time.", "Add --real-time 20, or leave them out.")
    found = examine(checks or tuple(CheckName))
    if as_json:
        answer = {"ok": all(one.found for one in found), "checks": [one.as_json() for one in found]}
        typer.echo(json.dumps(answer, indent=1))
    else:
        _show(found)
    if not all(one.found for one in found):
        raise typer.Exit(1)


def _show(found: list[Check]) -> None:
    table = Table("", "what", "found", "needed for", box=box.SIMPLE_HEAD)
    for one in found:
        found_it = Text("yes", style="green") if one.found else Text("no", style="red")
        table.add_row(found_it, one.name, one.detail, one.purpose)
    console.print(table)
    for one in found:
        if not one.found:
            console.print(Text.assemble((one.name, "bold"), f": {one.remedy}"), highlight=False, soft_wrap=True)

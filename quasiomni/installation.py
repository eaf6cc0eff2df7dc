"""The command that looks at this computer: what works here, and what is missing for the rest."""

from __future__ import annotations

import json
from typing import Annotated

import typer
from rich import box
from rich.table import Table
from rich.text import Text

from hil.bench.doctor import Check, CheckName, examine
from quasiomni.application import app, console


@app.command()
def doctor(
    checks: Annotated[list[CheckName] | None, typer.Argument(help="What must be there. Default: everything.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON in place of a table.")] = False,
) -> None:
    """What is installed here, and what is missing for what. Exit code 1 if something is."""
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

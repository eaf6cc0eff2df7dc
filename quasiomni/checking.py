"""The command that says whether files belong together."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Final

import typer

from hil.checking import Checked, Severity, Verdict, check_files
from quasiomni.application import app, console

_EXIT_CODES: Final = {Verdict.FITS: 0, Verdict.DOES_NOT_FIT: 1, Verdict.UNREADABLE: 2}

_STYLES: Final = {
    Severity.UNREADABLE: "bold red",
    Severity.ERROR: "bold red",
    Severity.WARNING: "yellow",
    Severity.ASSUMED: "dim",
}

_VERDICTS: Final = {
    Verdict.FITS: "They fit.",
    Verdict.DOES_NOT_FIT: "They do not describe one vehicle.",
    Verdict.UNREADABLE: "Not everything can be read.",
}


@app.command()
def check(
    files: Annotated[
        list[Path], typer.Argument(help="Vehicle file, network file, EDS files, run folders, logs, records.")
    ],
    as_json: Annotated[bool, typer.Option("--json", help="Print the findings as JSON.")] = False,
) -> None:
    """Say whether files belong together, and what is assumed. Exit code: 0 they fit, 1 they do not, 2 unreadable."""
    checked = check_files(files)
    if as_json:
        typer.echo(json.dumps(checked.to_json(), indent=1, ensure_ascii=False))
    else:
        _show(checked)
    raise typer.Exit(_EXIT_CODES[checked.verdict])


def _show(checked: Checked) -> None:
    for path, kind in checked.files.items():
        console.print(f"{kind}: {path}", highlight=False, markup=False, soft_wrap=True)
    for severity in Severity:
        for finding in checked.findings:
            if finding.severity is severity:
                text = f"{finding.where}: {finding.text}" if severity is Severity.ASSUMED else finding.text
                console.print(f"{severity}: ", style=_STYLES[severity], end="")
                console.print(f"{text} {finding.remedy}", highlight=False, markup=False, soft_wrap=True)
    console.print(_VERDICTS[checked.verdict], style="bold")

"""The command that lets the master of the emulated vehicle die, and reports how it comes to rest."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer
from rich import box
from rich.table import Table

from hil.network import network_file_of
from hil.safety import MasterDeathReport, StopSettings
from ident.writing import refuse_inputs, write_whole
from quasiomni.application import app, console
from quasiomni.options import EngineOption, NetworkOption, SeedOption, choose_engine


@app.command()
def safety(
    speed: Annotated[float, typer.Option(min=0.05, help="Speed when the master dies [m/s].")] = 1.5,
    abort: Annotated[int, typer.Option(min=0, max=3, help="6007h: abort connection option code.")] = 1,
    quick_stop: Annotated[int, typer.Option(min=0, max=8, help="605Ah: quick stop option code.")] = 2,
    fault_reaction: Annotated[int, typer.Option(min=0, max=4, help="605Eh: fault reaction option code.")] = 2,
    deceleration: Annotated[float, typer.Option(min=0.05, help="6085h, as that of the vehicle [m/s²].")] = 2.0,
    prototype: Annotated[str, typer.Option(help="`prototype`, `compact`, or the path of your own.")] = "prototype",
    network: NetworkOption = None,
    engine: EngineOption = None,
    seed: SeedOption = 1,
    out: Annotated[Path | None, typer.Option("--json", help="File for the report.")] = None,
) -> None:
    """Let the master die at speed: is the vehicle at rest, after what time and distance? Exit code 1 if not as set."""
    chosen = choose_engine(engine)
    from hil.safety.emulated import let_master_die

    refuse_inputs([out], [Path(prototype), network])
    settings = StopSettings(speed, abort, quick_stop, fault_reaction, deceleration)
    report = let_master_die(prototype, network or network_file_of(prototype), settings, seed, chosen)
    _show(report)
    if out is not None:
        write_whole(json.dumps(report.to_json(), indent=2, ensure_ascii=False) + "\n", out)
    if not report.passed:
        raise typer.Exit(1)


def _show(report: MasterDeathReport) -> None:
    table = Table(box=box.SIMPLE_HEAD)
    for column in ("", "predicted", "measured", "truth"):
        table.add_column(column, justify="left" if not column else "right")
    for row in report.rows():
        table.add_row(*row)
    console.print(f"The master died at {report.speed:.3f} m/s. {report.chain}.", highlight=False)
    console.print(table)
    for role, state in report.states.items():
        console.print(f"{role}: {state}, error code {report.error_codes[role]:04X}h", highlight=False)
    if report.at_rest:
        console.print("The vehicle is at rest.")
    else:
        console.print("The vehicle still moves.", style="bold red")
    if not report.passed:
        console.print("Not as the option codes and the ramp say.", style="bold red")

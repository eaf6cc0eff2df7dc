"""The command that packages a vehicle with its controller as a system."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fmu.platforms import parse_platforms
from hil.cosimulation.system import export_system
from quasiomni.application import app, console
from quasiomni.options import ForceOption
from quasiomni.showing import bars


@app.command("ssp")
def build(
    run: Annotated[Path, typer.Argument(help="Run folder, identified.")],
    model: Annotated[
        Path | None,
        typer.Option(help="parameters.toml that `diagnose --extended` wrote: the vehicle has its effects."),
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="File to write. Default: system.ssp in RUN.")] = None,
    platforms: Annotated[
        str, typer.Option(help="`all`, `host`, or names parted by commas, e.g. `x86_64-linux,x86_64-windows`.")
    ] = "all",
    force: ForceOption = False,
) -> None:
    """Package the vehicle and the controller of its lane change as a system (SSP), with sets of parameters."""
    chosen = parse_platforms(platforms)
    with bars() as shown:
        task = shown.add_task("compiling", total=None)

        def compiled(compiler: str, done: int, total: int) -> None:
            shown.update(task, description=f"compiling ({compiler})", completed=done, total=total)

        written = export_system(run, out or run / "system.ssp", chosen, model, force=force, compiled=compiled)
    console.print(f"Written: {written.path}, {written.size / 1e3:.0f} kB, in {written.seconds:.1f} s")

"""The commands around the FMU: build it from a run, replay a record through it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fmu.description import FmiVersion
from fmu.packaging import Order
from fmu.platforms import parse_platforms
from fmu.variables import Inputs
from hil.export import export_run
from quasiomni.application import app, console


@app.command("fmu")
def build(
    run: Annotated[Path, typer.Argument(help="Run folder, identified.")],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="File to write. Default: platform.fmu in RUN.")
    ] = None,
    fmi: Annotated[FmiVersion, typer.Option(help="Version of FMI: 2 for 2.0, 3 for 3.0.")] = FmiVersion.FMI2,
    platforms: Annotated[
        str, typer.Option(help="`all`, `host`, or names parted by commas, e.g. `x86_64-linux,x86_64-windows`.")
    ] = "all",
    inputs: Annotated[
        Inputs, typer.Option(help="Motor torques, or wheel speeds with the drives' inner loop.")
    ] = Inputs.TORQUE,
) -> None:
    """Package the identified model, with its confirmed effects, as an FMU for co-simulation and model exchange."""
    order = Order(fmi, inputs, parse_platforms(platforms))
    written = export_run(run, out or run / "platform.fmu", order, console)
    console.print(f"Written: {written.path}, {written.size / 1e3:.0f} kB, in {written.seconds:.1f} s")

"""The commands around the FMU: build it from a run, replay a record through it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fmu.description import FmiVersion
from fmu.packaging import Order
from fmu.platforms import parse_platforms
from fmu.variables import Inputs
from hil.campaign.folder import RunFolder, network_file_of, open_run
from hil.campaign.reading import read_any
from hil.cosim import outcome_table, replay, write_plot
from hil.export import export_run
from hil.network import load_network
from hil.workflow import progress
from ident.records.record import Record
from ident.vehicle.description import load_vehicle
from ident.vehicle.geometry import Geometry
from quasiomni.application import app, console
from quasiomni.options import NetworkOption, VehicleOption


@app.command("fmu")
def build(
    run: Annotated[Path, typer.Argument(help="Run folder, identified.")],
    model: Annotated[
        Path | None,
        typer.Option(help="parameters.toml in place of that of RUN: what `diagnose --extended` wrote, for one."),
    ] = None,
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
    written = export_run(run, out or run / "platform.fmu", order, console, model)
    console.print(f"Written: {written.path}, {written.size / 1e3:.0f} kB, in {written.seconds:.1f} s")


@app.command()
def cosim(
    fmu: Annotated[Path, typer.Argument(help="FMU with torque inputs.")],
    record: Annotated[Path, typer.Option(help="Run folder, log, or CSV, Parquet or MF4 record.")],
    vehicle: VehicleOption = "prototype",
    network: NetworkOption = None,
    out: Annotated[Path | None, typer.Option(help="Plot to write. Default: beside the FMU, NAME.cosim.html.")] = None,
) -> None:
    """Replay a record's torques through an FMU, and say how far its motion is from the recorded one."""
    read, geometry = _record(record, vehicle, network)
    with progress(console) as bars:
        task = bars.add_task("simulating", total=None)
        outcomes = []
        for outcome in replay(fmu, read, geometry):
            outcomes.append(outcome)
            bars.update(task, description=f"simulated {outcome.step}")
    target = out or fmu.with_suffix(".cosim.html")
    write_plot(outcomes, target)
    console.print(outcome_table(outcomes), f"Written: {target}")


def _record(path: Path, vehicle: str, network: Path | None) -> tuple[Record, Geometry]:
    """A record with the geometry of its vehicle; a run folder knows its own."""
    if RunFolder(path).manifest.is_file():
        run = open_run(path)
        return read_any(path, run.network), run.plan.vehicle.geometry
    return read_any(path, load_network(network or network_file_of(vehicle))), load_vehicle(vehicle).geometry

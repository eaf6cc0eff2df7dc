"""The commands around the FMU: build it from a run, replay a record through it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.table import Table

from fmu.bus.system import TxClock
from fmu.description import FmiVersion
from fmu.packaging import Order
from fmu.platforms import parse_platforms
from fmu.variables import Carried, Inputs
from hil.campaign.folder import sources_of
from hil.campaign.reading import read_as
from hil.cosimulation.assessment import refuse_unusable_fmu
from hil.cosimulation.export import export_run
from hil.cosimulation.replay import Outcome, replay, write_plot
from ident.errors import UserError
from ident.extras import Extra, require
from ident.plant.contact import Contacts
from ident.report.digits import percent, unit_text
from ident.writing import refuse_inputs
from quasiomni.application import app, console
from quasiomni.options import ForceOption, GivenVehicleOption, NetworkOption, require_readers, tell_native
from quasiomni.showing import bars


@app.command("fmu")
def build(
    context: typer.Context,
    run: Annotated[Path, typer.Argument(help="Run folder, identified.")],
    model: Annotated[
        Path | None,
        typer.Option(help="parameters.toml in place of that of RUN: what `diagnose --extended` wrote, for one."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="File to write. Default: platform.fmu in RUN, with --bus vehicle_on_bus.fmu."),
    ] = None,
    fmi: Annotated[FmiVersion, typer.Option(help="Version of FMI: 2 for 2.0, 3 for 3.0.")] = FmiVersion.FMI2,
    platforms: Annotated[
        str, typer.Option(help="`all`, `host`, or names parted by commas, e.g. `x86_64-linux,x86_64-windows`.")
    ] = "all",
    inputs: Annotated[
        Inputs, typer.Option(help="Motor torques, or wheel speeds with the drives' inner loop.")
    ] = Inputs.TORQUE,
    contacts: Annotated[
        Contacts,
        typer.Option(help="`stiff` for implicit solvers and co-simulation, `soft` for explicit ones as Runge-Kutta."),
    ] = Contacts.STIFF,
    limits: Annotated[
        bool, typer.Option("--limits", help="Torques beyond the motors' peak torque are limited to it.")
    ] = False,
    arrays: Annotated[
        bool, typer.Option("--arrays", help="FMI 3.0: arrays of the four wheels beside scalars, `torque` for one.")
    ] = False,
    effects: Annotated[
        Carried,
        typer.Option(
            help="Of size zero, as parameters to set: those without states of their own, or `all`, delays, play and "
            "compliance too."
        ),
    ] = Carried.STATELESS,
    bus: Annotated[
        bool, typer.Option("--bus", help="With its drives and encoders as CANopen nodes, FMI-LS-BUS 1.0, FMI 3.0.")
    ] = False,
    drive: Annotated[
        str | None, typer.Option(help="With --bus: one drive alone, with ports for its shaft, e.g. `drive_fl`.")
    ] = None,
    tx_clock: Annotated[
        TxClock, typer.Option(help="With --bus: `triggered` for importers that know no `countdown`.")
    ] = TxClock.COUNTDOWN,
    force: ForceOption = False,
) -> None:
    """Package the identified model, with its confirmed effects, as an FMU for co-simulation and model exchange."""
    if bus:
        _refuse_of_plants(context)
    order = Order(fmi, inputs, parse_platforms(platforms), contacts, limits, arrays, effects)
    if bus:
        from hil.lsbus.export import export_bus_fmu  # needs the emulator's tables, which other FMUs do without
    elif drive is not None or tx_clock is not TxClock.COUNTDOWN:
        raise UserError("--drive and --tx-clock are of an FMU on a bus.", "Add --bus, or leave them out.")
    target = out or run / (f"{drive}.fmu" if drive else "vehicle_on_bus.fmu" if bus else "platform.fmu")
    with bars() as shown:
        task = shown.add_task("compiling", total=None)

        def compiled(compiler: str, done: int, total: int) -> None:
            shown.update(task, description=f"compiling ({compiler})", completed=done, total=total)

        if bus:
            written = export_bus_fmu(
                run, target, order.platforms, model, drive=drive, tx_clock=tx_clock, force=force, compiled=compiled
            )
        else:
            written = export_run(run, target, order, model, force=force, compiled=compiled)
    console.print(f"Written: {written.path}, {written.size / 1e3:.0f} kB, in {written.seconds:.1f} s")


_OF_PLANTS = ("fmi", "inputs", "contacts", "limits", "arrays", "effects")
"""Options of FMUs without devices."""


def _refuse_of_plants(context: typer.Context) -> None:
    """Drives decide what torque there is, and a bus needs the clocks of FMI 3.0."""
    sources = {name: context.get_parameter_source(name) for name in _OF_PLANTS}
    given = [name for name, source in sources.items() if source is not None and source.name == "COMMANDLINE"]
    if given:
        raise UserError(f"--{given[0]} is of FMUs without devices.", "Leave it out, or leave out --bus.")
    require(Extra.EMULATOR, "--bus", ("durand",))


@app.command()
def cosim(
    fmu: Annotated[Path, typer.Argument(help="FMU with torque inputs.")],
    record: Annotated[Path, typer.Option(help="Run folder, log, or CSV, Parquet or MF4 record.")],
    vehicle: GivenVehicleOption = None,
    network: NetworkOption = None,
    out: Annotated[Path | None, typer.Option(help="Plot to write. Default: beside the FMU, NAME.cosim.html.")] = None,
    force: ForceOption = False,
) -> None:
    """Replay a record's torques through an FMU, and say how far its motion is from the recorded one."""
    require(Extra.COSIM, "cosim")
    require_readers([record])
    target = out or fmu.with_suffix(".cosim.html")
    refuse_inputs([target], [fmu, *sources_of(record), None if vehicle is None else Path(vehicle), network])
    refuse_unusable_fmu(fmu, force=force)
    read, described = read_as(record, vehicle, network)
    tell_native(fmu)
    with bars() as shown:
        task = shown.add_task("simulating", total=None)
        outcomes = []
        for outcome in replay(fmu, read, described.vehicle.geometry):
            outcomes.append(outcome)
            shown.update(task, description=f"simulated {outcome.step}")
    write_plot(outcomes, target)
    console.print(_table(outcomes), f"Written: {target}")


def _table(outcomes: Sequence[Outcome]) -> Table:
    table = Table(title="Outcome: simulated with the recorded torques, against the recorded velocity")
    table.add_column("step")
    table.add_column("velocity")
    table.add_column("rms", justify="right")
    table.add_column("unit")
    table.add_column("difference", justify="right")
    for outcome in outcomes:
        rms = float(np.sqrt(np.mean(outcome.measured**2)))
        table.add_row(outcome.step, outcome.coordinate, f"{rms:.3g}", unit_text(outcome.unit), percent(outcome.nrmse))
    return table

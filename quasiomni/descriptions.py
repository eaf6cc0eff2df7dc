"""Commands that describe the network to other tools, and test a node against a conformance trace."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hil.descriptions import write_dbc, write_device_files
from hil.network import DEFAULT_NETWORK, load_network, network_file_of
from hil.network.described import load_described
from ident.extras import Extra, require
from ident.writing import refuse_inputs, write_whole
from quasiomni.application import app, console
from quasiomni.options import NetworkOption, load_emulation


@app.command()
def eds(
    out: Annotated[Path, typer.Option(help="Folder for the files; made when it is missing.")],
    network: NetworkOption = None,
) -> None:
    """Write the EDS of every kind of device and the DCF of every node, as configured by the master."""
    for path in write_device_files(load_network(network or DEFAULT_NETWORK), out):
        console.print(str(path), highlight=False)


@app.command()
def dbc(
    out: Annotated[Path, typer.Option(help="File to write, e.g. `vehicle.dbc`.")],
    network: NetworkOption = None,
    vehicle: Annotated[
        str | None, typer.Option(help="Vehicle file that gives what the network file leaves to it: gear, rated torque.")
    ] = None,
) -> None:
    """Write a DBC of the network: all frames by name, PDOs in SI units and vehicle signs."""
    require(Extra.DBC, "dbc")
    if vehicle is None:
        loaded = load_network(network or DEFAULT_NETWORK)
    else:
        loaded = load_described(vehicle, network or network_file_of(vehicle)).network
    refuse_inputs([out], [loaded.path, *(node.eds for node in loaded.nodes)])
    write_whole(write_dbc(loaded), out)
    console.print(str(out), highlight=False)


@app.command()
def conformance(
    trace: Annotated[Path, typer.Argument(help="Trace of CiA's conformance tool, as CANopenDemo publishes it.")],
    out: Annotated[Path | None, typer.Option(help="Write a Markdown table of all cases.")] = None,
) -> None:
    """Replay the trace of a conformance test against an emulated drive."""
    load_emulation()
    from hil.conformance.emulated import replay_trace
    from hil.conformance.report import write_page

    refuse_inputs([out], [trace])
    verdicts = replay_trace(trace)
    replayed = [verdict for verdict in verdicts if verdict.outcome is not None]
    passed = sum(verdict.passed for verdict in replayed)
    console.print(f"{len(verdicts)} cases, {len(replayed)} replayed, {passed} passed.")
    for verdict in replayed:
        if not verdict.passed:
            console.print(f"{verdict.case.number} {verdict.case.name}: {verdict}", highlight=False, markup=False)
    if out is not None:
        write_whole(write_page(verdicts), out)
        console.print(str(out), highlight=False)
    if passed < len(replayed):
        raise typer.Exit(1)

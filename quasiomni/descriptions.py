"""Commands that describe the network to other tools, and test a node against a conformance trace."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hil.descriptions import write_dbc, write_device_files
from hil.network import DEFAULT_NETWORK, load_network
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
) -> None:
    """Write a DBC of the network: all frames by name, PDOs in SI units and vehicle signs."""
    out.write_text(write_dbc(load_network(network or DEFAULT_NETWORK)), encoding="utf-8")
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

    verdicts = replay_trace(trace)
    replayed = [verdict for verdict in verdicts if verdict.outcome is not None]
    passed = sum(verdict.passed for verdict in replayed)
    console.print(f"{len(verdicts)} cases, {len(replayed)} replayed, {passed} passed.")
    for verdict in replayed:
        if not verdict.passed:
            console.print(f"{verdict.case.number} {verdict.case.name}: {verdict}", highlight=False, markup=False)
    if out is not None:
        out.write_text(write_page(verdicts), encoding="utf-8")
        console.print(str(out), highlight=False)
    if passed < len(replayed):
        raise typer.Exit(1)

"""The commands around the bus: SocketCAN programs on it, faults on it, how busy it is.

`can exec` stands before every call of a SocketCAN program, so nothing is loaded here that only one command needs.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich import box
from rich.table import Table
from rich.text import Text

from hil.bench import control
from hil.bus.report import ListenerReport
from hil.bus.socketcan import build_library, environment, is_served
from ident.errors import BusError
from quasiomni.application import app, console, tell
from quasiomni.options import DEFAULT_BUS, NetworkOption, VehicleOption

can_app = typer.Typer(help="The CAN bus: unmodified SocketCAN programs on it, faults, load.", no_args_is_help=True)
app.add_typer(can_app, name="can")

BusOption = Annotated[str, typer.Option(help="The emulator's bus, as `quasiomni emulate --bus` was given it.")]


@can_app.command("exec", context_settings={"ignore_unknown_options": True})
def execute(
    command: Annotated[list[str], typer.Argument(help="Program and arguments, e.g. `candump can0`; after `--`.")],
    bus: Annotated[
        list[str] | None,
        typer.Option(help="The emulator's bus. Several: `--bus can0=unix:/tmp/can0 --bus can1=unix:/tmp/can1`."),
    ] = None,
    interface: Annotated[
        str, typer.Option(help="Name under which the program finds a bus that was given without one.")
    ] = "can0",
) -> None:
    """Run an unmodified SocketCAN program on a `unix:` bus, or several: `quasiomni can exec -- candump can0`."""
    interfaces = parse_interfaces(bus or [DEFAULT_BUS], interface)
    found = environment(os.environ, build_library(), interfaces)
    for path in interfaces.values():
        if not is_served(path):
            # No refusal: the program may start the emulator itself, or wait for it.
            remedy = f"Start the emulator first: quasiomni emulate --bus unix:{path}."
            tell(BusError(f"Nobody serves unix:{path} yet.", remedy))
    try:
        os.execvpe(command[0], command, found)
    except OSError as error:
        raise BusError(f"{command[0]} cannot be run: {error.strerror}.", "Install it, or give its path.") from error


ControlOption = Annotated[
    Path | None, typer.Option("--control", help="Where the emulator takes commands. Default: beside a `unix:` bus.")
]


@can_app.command()
def fault(
    text: Annotated[list[str], typer.Argument(help="Faults such as `drop@0x181:rate=10%,to=2s`, counted from now.")],
    bus: BusOption = DEFAULT_BUS,
    at: ControlOption = None,
) -> None:
    """Inject faults into a running emulator. `quasiomni can kinds` lists what there is."""
    for one in text:
        console.print(control.command(at or control.control_path(bus), f"add {one}"), highlight=False)


@can_app.command()
def faults(bus: BusOption = DEFAULT_BUS, at: ControlOption = None) -> None:
    """List the faults of a running emulator that last or are still to come."""
    console.print(control.command(at or control.control_path(bus), "list"), highlight=False, markup=False)


@can_app.command()
def heal(
    numbers: Annotated[list[int] | None, typer.Argument(help="Numbers of faults to end. Default: all.")] = None,
    bus: BusOption = DEFAULT_BUS,
    at: ControlOption = None,
) -> None:
    """End faults of a running emulator."""
    for order in [f"remove {number}" for number in numbers or ()] or ["clear"]:
        console.print(control.command(at or control.control_path(bus), order), highlight=False)


@can_app.command()
def kinds() -> None:
    """List the faults that can be injected, where, and the numbers that each takes."""
    from hil.faults.fault import SPECIFICATIONS

    table = Table("fault", "where", "what", "numbers (default)", box=box.SIMPLE_HEAD)
    for kind, one in SPECIFICATIONS.items():
        numbers = "; ".join(f"{name} ({number.default:g}): {number.what}" for name, number in one.parameters.items())
        table.add_row(kind, one.target, one.what, numbers)
    console.print(table)
    console.print("All take from and to, counted from the injection. Units: s, ms, us, %, /s.", highlight=False)


@can_app.command()
def load(
    vehicle: VehicleOption = "prototype",
    network: NetworkOption = None,
    bit_rate: Annotated[float | None, typer.Option(min=1.0, help="Another bit rate [bit/s].")] = None,
    cycle: Annotated[float | None, typer.Option(min=1e-5, help="Another cycle period [s].")] = None,
    bus: Annotated[
        str | None, typer.Option(help="Show who listens on the bus of a running emulator, and who has lost frames.")
    ] = None,
    at: ControlOption = None,
) -> None:
    """Whether a network file's frames fit on a real bus: exit code 1 where they do not. With --bus, who loses some."""
    if bus is not None or at is not None:
        _show_clients(control.clients(at or control.control_path(bus or DEFAULT_BUS)))
        return
    from hil.bus.schedule import schedule
    from hil.network import load_network, network_file_of
    from ident.vehicle.description import load_vehicle

    if network is None:
        # A misspelled name must not be taken for a vehicle with the default network.
        load_vehicle(vehicle)
    found = schedule(load_network(network or network_file_of(vehicle)), bit_rate, cycle)
    table = Table("COB-ID", "sender", "bytes", "bits", "every", "longest wait", box=box.SIMPLE_HEAD)
    for frame in found.frames:
        response = Text(f"{frame.response * 1e3:.2f} ms", style="" if frame.in_time else "red")
        times = f"{frame.period * 1e3:g} ms", response
        table.add_row(
            f"{frame.can_id:03X}h", frame.sender, str(frame.length), f"{frame.shortest}-{frame.longest}", *times
        )
    console.print(table)
    least, most = found.load
    console.print(
        f"Load at {found.bit_rate / 1e3:g} kbit/s: {least:.0%} to {most:.0%}, by stuff bits.", highlight=False
    )
    if found.late:
        names = ", ".join(f"{frame.can_id:03X}h" for frame in found.late)
        late = f"Cannot work on a real bus: {names} may not be through in time."
        console.print(late, highlight=False, style="red")
        raise typer.Exit(code=1)
    console.print("Every frame is through before the next one of its kind.", highlight=False)


def parse_interfaces(buses: Sequence[str], unnamed: str) -> dict[str, Path]:
    """Names of CAN interfaces and paths of their hubs.

    Args:
        buses: `unix:PATH` or `NAME=unix:PATH`.
        unnamed: name of the one that has none.

    Raises:
        BusError: one is no `unix:` bus, or two have one name.
    """
    found: dict[str, Path] = {}
    for text in buses:
        name, equals, bus = text.partition("=")
        if not equals or ":" in name:
            name, bus = unnamed, text
        if name in found:
            raise BusError(f"Two buses are called {name}.", "Name them: --bus can0=unix:PATH --bus can1=unix:PATH.")
        found[name] = hub_path(bus)
    return found


def _show_clients(clients: Sequence[ListenerReport]) -> None:
    table = Table("process", "program", "waiting", "lost", "", box=box.SIMPLE_HEAD)
    for one in clients:
        lost = Text(str(one.dropped), style="red" if one.dropped else "")
        table.add_row(str(one.pid), one.program, str(one.waiting), lost, "has left" if one.gone else "")
    console.print(table if clients else "Nobody listens.")
    lost_in_all = sum(one.dropped for one in clients)
    if lost_in_all:
        remedy = "Who reads too slowly has to read faster, or to filter: candump can0,181:7FF."
        console.print(f"{lost_in_all} frames are lost. {remedy}", highlight=False, style="red")


def hub_path(bus: str) -> Path:
    """Path of the hub of a `unix:` bus.

    Raises:
        BusError: it is another bus.
    """
    interface, _, path = bus.partition(":")
    if interface != "unix" or not path:
        raise BusError(f"{bus} is not on this machine alone.", "Serve the emulator on a bus like unix:/tmp/can0.")
    return Path(path)

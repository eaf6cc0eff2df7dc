"""The commands around the bus: SocketCAN programs on it, faults on it, how busy it is."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from hil.socketcan import build_library, environment
from hil.socketcan.library import default_cache
from ident.errors import BusError
from quasiomni.application import app

can_app = typer.Typer(help="The CAN bus: unmodified SocketCAN programs on it, faults, load.", no_args_is_help=True)
app.add_typer(can_app, name="can")

BusOption = Annotated[str, typer.Option(help="The emulator's bus, as `quasiomni emulate --bus` was given it.")]


@can_app.command("exec", context_settings={"ignore_unknown_options": True})
def execute(
    command: Annotated[list[str], typer.Argument(help="Program and arguments, e.g. `candump can0`; after `--`.")],
    bus: BusOption = "unix:/tmp/can0",
    interface: Annotated[str, typer.Option(help="Name under which the program finds the bus.")] = "can0",
) -> None:
    """Run an unmodified SocketCAN program on a `unix:` bus: `quasiomni can exec -- candump can0`."""
    library = build_library(default_cache(os.environ))
    found = environment(os.environ, library, {interface: hub_path(bus)})
    try:
        os.execvpe(command[0], command, found)
    except OSError as error:
        raise BusError(f"{command[0]} cannot be run: {error.strerror}.", "Install it, or give its path.") from error


def hub_path(bus: str) -> Path:
    """Path of the hub of a `unix:` bus.

    Raises:
        BusError: it is another bus.
    """
    interface, _, path = bus.partition(":")
    if interface != "unix" or not path:
        raise BusError(f"{bus} is not on this machine alone.", "Serve the emulator on a bus like unix:/tmp/can0.")
    return Path(path)

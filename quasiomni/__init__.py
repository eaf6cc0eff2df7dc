"""The command line and the public Python interface: the composition root.

One module a group of commands; what they do lives in `hil`. Names for programs are those of `quasiomni.interface`,
loaded when they are first asked for.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    import typer

    from quasiomni.interface import (
        LeastSquares,
        Mode,
        Motion,
        UserError,
        WeightedLeastSquares,
        assess,
        diagnose,
        export_fmu,
        extend,
        identify,
        load_vehicle,
        model_of,
        open_bench,
        read_record,
        simulate,
    )

    app: typer.Typer
    """All commands."""

INTERFACE: Final = (
    *("read_record", "load_vehicle", "identify", "assess", "model_of", "diagnose", "extend", "simulate", "export_fmu"),
    *("open_bench", "LeastSquares", "WeightedLeastSquares", "Mode", "Motion", "UserError"),
)
"""Names for programs."""

__all__ = [
    "COMMANDS",
    "LeastSquares",
    "Mode",
    "Motion",
    "UserError",
    "WeightedLeastSquares",
    "app",
    "assess",
    "diagnose",
    "export_fmu",
    "extend",
    "identify",
    "load_vehicle",
    "main",
    "model_of",
    "open_bench",
    "read_record",
    "simulate",
]

COMMANDS: Final[Mapping[str, Mapping[str, str]]] = {
    "driving": {
        "demo": "The whole story on the emulator: boot, four steps, parameters beside the truth, lane change, report.",
        "campaign": "Drive the identification steps and record every frame; on the emulator, or with --bus on a real "
        "vehicle.",
    },
    "identification": {
        "identify": "Identify the parameters from recorded frames or records alone; writes parameters.toml and "
        "report.html.",
        "report": "Write the HTML report of a run again, from its frames.",
    },
    "converting": {
        "convert": "Write the frames and channels of a run, a log or a record in another format: MCAP for Foxglove, "
        "BLF, CSV, ...",
    },
    "describing": {
        "init": "Describe your own vehicle: writes a commented vehicle file and, beside it, network and EDS files.",
    },
    "checking": {
        "check": "Say whether files belong together, and what is assumed. Exit code: 0 they fit, 1 they do not, 2 "
        "unreadable.",
    },
    "gap": {
        "diagnose": "Say why model and machine disagree: which effect, where, how sure, how much it closes, what to do "
        "next.",
        "gap": "Drive recorded torques through the emulated vehicle before and after, and say how far its gap shrinks.",
    },
    "fmu": {
        "fmu": "Package the identified model, with its confirmed effects, as an FMU for co-simulation and model "
        "exchange.",
        "cosim": "Replay a record's torques through an FMU, and say how far its motion is from the recorded one.",
    },
    "system": {
        "ssp": "Package the vehicle and the controller of its lane change as a system (SSP), with sets of parameters.",
    },
    "serving": {
        "emulate": "Serve the emulated prototype on a CAN bus, for masters in other processes. Stop it with Ctrl-C.",
    },
    "replaying": {
        "replay": "Play a record into the bench: which emulated node answers otherwise, where and when. Exit code 1 if "
        "one does.",
    },
    "can": {"can": "The CAN bus: unmodified SocketCAN programs on it, faults, load."},
    "descriptions": {
        "eds": "Write the EDS of every kind of device and the DCF of every node, as configured by the master.",
        "dbc": "Write a DBC of the network: all frames by name, PDOs in SI units and vehicle signs.",
        "conformance": "Replay the trace of a conformance test against an emulated drive.",
    },
    "safety": {
        "safety": "Let the master die at speed: is the vehicle at rest, after what time and distance? Exit code 1 if "
        "not as set.",
    },
    "installation": {
        "doctor": "What is installed here, and what is missing for what. Exit code 1 if something is, or cycles are "
        "too late.",
    },
    "exam": {"exam": "The withheld exam of the gap diagnosis."},
}
"""Module -> the commands and groups of commands that it adds to `app`, each with the first line of its help.

Help and completion name all of them without loading any: together they need half of the mathematics there is.
"""


def main() -> None:
    """Entry point."""
    from quasiomni import application

    application.main()


def load_commands(words: Sequence[str]) -> None:
    """Load what a command line needs: the module of its command, or all where it names none.

    On a vehicle's computer there is no emulator, and a command that looks after the bus waits for no mathematics.
    """
    asked = [module for module, commands in COMMANDS.items() if words and words[0] in commands]
    for module in asked or COMMANDS:
        if asked == ["serving"]:
            # python-can loads it for logs in MF4, and pandas with it: longer than it takes to load the emulator.
            with _left_out("asammdf"):
                import_module(f"quasiomni.{module}")
        else:
            import_module(f"quasiomni.{module}")


@contextmanager
def _left_out(package: str) -> Iterator[None]:
    """Inside, a package seems not to be installed."""
    if package in sys.modules:
        yield
        return
    sys.modules[package] = None  # type: ignore[assignment]  # as the documentation of `import` has it
    try:
        yield
    finally:
        del sys.modules[package]


def __getattr__(name: str) -> Any:
    """What is loaded when it is asked for: `app`, with all commands in it, and the names for programs."""
    if name in INTERFACE:
        return getattr(import_module("quasiomni.interface"), name)
    if name != "app":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    load_commands(())
    from quasiomni import application

    return application.app

"""The command line: the composition root. One module a group of commands; what they do lives in `hil`."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Final

import typer

from quasiomni import application

__all__ = ["COMMANDS", "app", "main"]

COMMANDS: Final[Mapping[str, Sequence[str]]] = {
    "can": ["can"],
    "descriptions": ["eds", "dbc", "conformance"],
    "exam": ["exam"],
    "fmu": ["fmu", "cosim"],
    "gap": ["diagnose"],
    "identification": ["demo", "campaign", "identify", "report"],
    "safety": ["safety"],
    "serving": ["emulate"],
}
"""Module -> the commands and groups of commands that it adds to `app`."""


def main() -> None:
    """Entry point."""
    load_commands(sys.argv[1:])
    application.main()


def load_commands(words: Sequence[str]) -> None:
    """Load what a command line needs: the module of its command, or all where it names none.

    On a vehicle's computer there is no emulator, and a command that looks after the bus waits for no mathematics.
    """
    asked = [module for module, commands in COMMANDS.items() if words and words[0] in commands]
    for module in asked or COMMANDS:
        import_module(f"quasiomni.{module}")


if TYPE_CHECKING:
    app: typer.Typer
    """All commands."""


def __getattr__(name: str) -> typer.Typer:
    """`app`, with all commands in it, for programs that run commands in their own process."""
    if name != "app":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    load_commands(())
    return application.app

"""The command line: the composition root. One module a group of commands; what they do lives in `hil`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Final

import typer

from quasiomni import application

__all__ = ["GROUPS", "app", "main"]

GROUPS: Final = ("can", "descriptions", "exam", "fmu", "gap", "identification", "safety", "serving")
"""Modules of commands, each of which adds its own to `app`."""

_ALONE: Final = frozenset({"can"})
"""Groups whose commands begin with the module's own name: only it is loaded, not the mathematics of the others."""


def main() -> None:
    """Entry point."""
    load_commands(sys.argv[1:])
    application.main()


def load_commands(words: Sequence[str]) -> None:
    """Load the commands that a command line may need."""
    for name in words[:1] if words and words[0] in _ALONE else GROUPS:
        import_module(f"quasiomni.{name}")


if TYPE_CHECKING:
    app: typer.Typer
    """All commands."""


def __getattr__(name: str) -> typer.Typer:
    """`app`, with all commands in it, for programs that run commands in their own process."""
    if name != "app":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    load_commands(())
    return application.app

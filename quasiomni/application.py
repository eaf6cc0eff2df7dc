"""The command line's application object, its consoles, and its entry point."""

from __future__ import annotations

import signal
import sys
from types import FrameType

import typer
from rich.console import Console
from rich.markup import escape

from ident.errors import BusError, UserError

app = typer.Typer(
    help="From prototype to trusted model: dynamic identification of quasi-omnidirectional platforms over CAN.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=False,
    rich_markup_mode="markdown",
)
console = Console()
errors = Console(stderr=True)


@app.callback()
def _always_a_group() -> None:
    # Without this, an application of which one command has been loaded is that command, and does not know its name.
    pass


def _interrupt(_signal: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt


def main() -> None:
    """Entry point: user errors become two lines and exit code 2; a closed terminal stops the drives like Ctrl-C."""
    for name in ("SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), _interrupt)
    try:
        app()
    except UserError as error:
        tell(error)
        sys.exit(2)
    except OSError as error:
        if error.filename is None:
            raise
        tell(UserError(f"{error.filename}: {error.strerror}.", "Name a file or folder that can be used."))
        sys.exit(2)


def tell(error: UserError) -> None:
    """Print what is wrong and the remedy, two lines."""
    label = "bus" if isinstance(error, BusError) else "error"
    errors.print(f"[bold red]{label}:[/bold red] {escape(error.what)}", highlight=False, soft_wrap=True)
    errors.print(f"[bold]remedy:[/bold] {escape(error.remedy)}", highlight=False, soft_wrap=True)

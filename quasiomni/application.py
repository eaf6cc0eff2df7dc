"""The command line's application object, its consoles, and its entry point."""

from __future__ import annotations

import errno
import signal
import sys
from types import FrameType
from typing import Annotated, Any, Final

import typer
from rich.console import Console
from rich.text import Text
from typer.core import TyperCommand, TyperGroup

from ident.errors import BusError, UserError
from quasiomni import COMMANDS, load_commands


class LazyGroup(TyperGroup):
    """All commands by name and summary; a command's module is loaded when that command is called or completed."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        named = {
            name: TyperCommand(name, help=summary) for group in COMMANDS.values() for name, summary in group.items()
        }
        self.commands = {**named, **self.commands}

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command that is called, loaded, with what is left of the words."""
        name = args[0]
        if any(name in group for group in COMMANDS.values()):
            load_commands(args)
            self.commands[name] = typer.main.get_group(app).commands[name]
        return super().resolve_command(ctx, args)


_DISK: Final = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EROFS}
"""What a disk answers that takes no more; who writes by way of a library may not know to which file."""

app = typer.Typer(
    cls=LazyGroup,
    help="From prototype to trusted model: dynamic identification of quasi-omnidirectional platforms over CAN.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    rich_markup_mode="markdown",
)
# Most of what is printed names files, steps and devices of the user: brackets in it are text, no markup.
console = Console(markup=False)
errors = Console(stderr=True, markup=False)


def _tell_version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        console.print(f"quasiomni {version('quasiomni')}", highlight=False)
        raise typer.Exit()


@app.callback()
def _options_of_all(
    _version: Annotated[
        bool, typer.Option("--version", callback=_tell_version, is_eager=True, help="Say which version this is.")
    ] = False,
) -> None:
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
        if error.filename is None and error.errno in _DISK:
            tell(UserError(f"What was to be written is not: {error.strerror}.", "Free some space, or mend the disk."))
            sys.exit(2)
        if error.filename is None:
            raise
        tell(UserError(f"{error.filename}: {error.strerror}.", "Name a file or folder that can be used."))
        sys.exit(2)


def tell(error: UserError) -> None:
    """Print what is wrong and the remedy, two lines."""
    label = "bus" if isinstance(error, BusError) else "error"
    for style, head, text in (("bold red", label, error.what), ("bold", "remedy", error.remedy)):
        errors.print(Text.assemble((f"{head}:", style), " ", visible(text)), highlight=False, soft_wrap=True)


def visible(text: str) -> str:
    """A text with its control characters written out: the name of a file must not move the cursor."""
    return "".join(char if char.isprintable() or char in "\n\xa0" else ascii(char)[1:-1] for char in text)


def show_next(command: str) -> None:
    """Print the command that comes next."""
    console.print(Text.assemble("Next: ", (command, "bold")), soft_wrap=True)

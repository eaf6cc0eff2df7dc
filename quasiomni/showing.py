"""What commands show while they work, and ask: stages, bars, lines, the person beside the vehicle."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from rich.markup import escape
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.text import Text

from ident.errors import CampaignError
from ident.stages import Stage
from quasiomni.application import console


@contextmanager
def bars() -> Iterator[Progress]:
    """Progress bars for long work."""
    columns = (SpinnerColumn(), TextColumn("{task.description:<26}", markup=False), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console) as shown:
        yield shown


@contextmanager
def bar(what: str) -> Iterator[Callable[[int, int], None]]:
    """One bar, moved by what is done, of how much."""
    with bars() as shown:
        task = shown.add_task(what, total=None)
        yield lambda done, total: shown.update(task, completed=done, total=total, description=f"{what} {done}/{total}")


@contextmanager
def stages(what: str = "") -> Iterator[Stage]:
    """The stage that runs, behind what it is part of."""
    head = f"{what}: " if what else ""
    with console.status(what or "working") as status:
        yield lambda stage: status.update(head + escape(stage))


def say(lines: Iterable[str], style: str | None = None) -> None:
    """Lines as they are, however long."""
    for line in lines:
        console.print(line, style=style, highlight=False, markup=False, soft_wrap=True)


@dataclass(frozen=True)
class HumanOperator:
    """Asks the person beside the vehicle to lift and lower it."""

    def lift(self) -> None:
        """Ask for the jack-stand."""
        self._ask("Put the vehicle on its jack-stand, all four wheels free to turn")

    def lower(self) -> None:
        """Ask for the floor."""
        self._ask("Put the vehicle on the floor, wheels about straight ahead")

    def load(self, mass: float) -> None:
        """Ask for a load."""
        self._ask(f"Fix a load of {mass:g} kg on the vehicle, over its centre")

    def unload(self) -> None:
        """Ask to take it off."""
        self._ask("Take the load off the vehicle")

    def _ask(self, what: str) -> None:
        if not sys.stdin.isatty():
            raise CampaignError(
                f"{what}: that needs a person at a terminal.", "Or give B_w: --b-w VALUE --b-w-std STD."
            )
        console.input(Text.assemble((what, "bold"), ", then press Enter. "))

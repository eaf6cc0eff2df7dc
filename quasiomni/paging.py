"""The options that open a page in the browser, in the commands that move an emulated vehicle."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import ModuleType
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hil.network import Network
from ident.errors import UserError
from ident.extras import Extra, require, require_engine
from quasiomni.application import console, errors

if TYPE_CHECKING:
    from hil.page.opening import Address, Page  # needs the emulator, which a real vehicle's computer does not have
    from hil.page.shown import Doing

LOOPBACK = "127.0.0.1"
PORT = 8080

WebOption = Annotated[
    bool, typer.Option("--web", help="Show the emulated vehicle on a page in the browser, with faults and a stop.")
]
WebHostOption = Annotated[
    str, typer.Option("--web-host", help="Address at which the page is served. Default: this computer alone.")
]
WebPortOption = Annotated[
    int, typer.Option("--web-port", min=0, max=65535, help="TCP port of the page; 0 takes any that is free.")
]


def plan_page(web: bool, host: str, port: int) -> Address | None:
    """The address of the page that was asked for; it can be served there.

    Args:
        web: whether there is to be one.
        host: address of this computer.
        port: TCP.

    Raises:
        UserError: the extra is missing, the address is taken or none of this computer, or given without a page.
    """
    if not web:
        if (host, port) != (LOOPBACK, PORT):
            raise UserError("--web-host and --web-port are of the page.", "Add --web, or leave them out.")
        return None
    require_engine(None, "--web")
    require(Extra.WEB, "--web")
    from hil.page.opening import Address, refuse_unservable

    address = Address(host, port)
    refuse_unservable(address)
    if not address.is_loopback:
        errors.print(
            f"Whoever reaches {host} can inject faults and stop this vehicle: the page asks for no password.",
            style="yellow",
            highlight=False,
            soft_wrap=True,
        )
    return address


@contextmanager
def paging(address: Address | None) -> Iterator[Page | None]:
    """The page, coming up while other things are done; None where there is to be none."""
    if address is None:
        yield None
        return
    from hil.page.opening import open_page

    with open_page(address) as page:
        yield page


def watching() -> ModuleType:
    """What shows a vehicle on a page, loaded only where there is one."""
    from hil.bench import watching

    return watching


def say_where(page: Page | None) -> None:
    """Wait until the page is served, and say where.

    Raises:
        UserError: it cannot be.
    """
    if page is not None:
        console.print(f"The page is {page.wait()}", highlight=False, soft_wrap=True)


def watching_bench(page: Page | None, title: str, told: Told, network: Network) -> Callable[[Any, Any], None]:
    """What to call with a vehicle and its bench before anything moves; does nothing without a page.

    Args:
        page: that shows them.
        title: of it.
        told: is told the step that is driven.
        network: of the vehicle, complete.
    """

    def begin(vehicle: Any, bench: Any) -> None:
        if page is not None:
            watching().watch_bench(page, title, vehicle, bench, network, told.doing)
            say_where(page)

    return begin


def watching_replay(page: Page | None, title: str, told: Told, pace: float) -> Callable[[Any, Any, Network], None]:
    """What to call with a vehicle, its bench and its network before anything moves; does nothing without a page.

    Args:
        page: that shows them.
        title: of it.
        told: is told the log that is played.
        pace: simulated seconds a second at most; 0: as many as it gets.
    """

    def begin(vehicle: Any, bench: Any, network: Network) -> None:
        if page is None:
            return
        shown = watching().watch_bench(page, title, vehicle, bench, network, told.doing)
        if pace > 0:
            bench.attend(watching().Pace(bench.clock.now, pace, shown.attend).attend)

    return begin


@dataclass
class Told:
    """The step that is driven, or the log that is played, as it was told last; progress is in what `unit` names."""

    step: str = ""
    done: int = 0
    total: int = 0
    unit: str = "cycles"
    follow: Callable[[str, int, int], None] = field(default=lambda *_: None)

    def __call__(self, step: str, done: int, total: int) -> None:
        """Take the progress of a step, and hand it on."""
        self.step, self.done, self.total = step, done, total
        self.follow(step, done, total)

    def doing(self) -> Doing:
        """As the page takes it."""
        from hil.page.shown import Doing

        return Doing(self.step, self.done, self.total, self.unit)

"""Drives a planned run on what is behind the bus: the emulator, an FMU, or a real vehicle."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import can
import typer
from rich.progress import Progress, TaskID
from rich.text import Text

from hil.bus.clock import Clock, FreeRunningClock, WallClock
from hil.bus.opening import open_bus
from hil.bus.unix import UnixBus
from hil.bus.urgency import urgent
from hil.campaign.driving import drive_run, keep_unusable_aside
from hil.campaign.folder import Run
from hil.campaign.lock import driving
from hil.campaign.order import Order
from hil.campaign.runner import Operator, check_network
from hil.frames.recorder import LogFormat
from ident.effects import Effect
from ident.errors import UserError
from ident.report.tables import loop_table, room_table
from quasiomni.application import console, errors
from quasiomni.filming import captioned, drawing
from quasiomni.options import (
    choose_engine,
    load_emulation,
    read_simulator,
    say_urgency,
    tell_native,
)
from quasiomni.paging import Told, paging, watching_bench
from quasiomni.showing import HumanOperator, bars, say

if TYPE_CHECKING:
    from hil.page.opening import Address
    from hil.video.film import Video


def drive_on_emulator(
    run: Run,
    order: Order,
    effects: Sequence[Effect],
    gui: bool,
    film: Video | None,
    *,
    force: bool = False,
    page: Address | None = None,
) -> None:
    """On the emulated vehicle, with a video or without, with a page or without.

    Raises:
        UserError: the run was driven on something else, or cannot be driven.
    """
    if not run.prototype:
        raise UserError(
            f"{order.out} was driven on {run.bus}, not on the emulator.", f"Go on with it there: --bus {run.bus}."
        )
    emulation = load_emulation()
    engine = choose_engine(run.engine) if order.resume else run.engine
    network, simulator = run.network.path, read_simulator(run.simulator, force=force)
    _say_assumed(emulation.assumed(run.emulated, network, simulator))
    told = Told()
    with paging(page) as opened:
        begin = watching_bench(opened, str(order.out), told, run.network)
        with (
            drawing(film) as video,
            emulation.bench(
                run.emulated,
                run.seed,
                gui,
                network,
                effects,
                engine=engine,
                video=video,
                simulator=simulator,
                begin=begin,
            ) as bench,
            _stop_is_no_error(order.out),
        ):
            _drive(run, order, bench.bus, bench.clock, bench.operator, film=film, told=told)


def drive_on_fmu(run: Run, order: Order, prototype: str, fmu: Path, *, own_devices: bool = False) -> None:
    """On an FMU with the drives and encoders of a prototype, or its own; it is native code, which is said first."""
    tell_native(fmu)
    if own_devices:
        from hil.lsbus.bench import bus_fmu_bench  # needs the emulator, which a real vehicle's computer does not have

        with bus_fmu_bench(fmu, run.seed, run.network.path) as on_bus, _stop_is_no_error(order.out):
            _drive(run, order, on_bus.bus, on_bus.clock, on_bus.operator)
        return
    bench = load_emulation().bench(prototype, run.seed, False, run.network.path, fmu=fmu)
    with bench as opened, _stop_is_no_error(order.out):
        _drive(run, order, opened.bus, opened.clock, opened.operator)


def drive_on_bus(run: Run, order: Order, name: str, *, ask: bool, lockstep: bool, priority: bool) -> None:
    """On what answers on a bus, after a question where `ask` is set; in lockstep where an emulator sits there, else in
    real time and, with `priority`, before other programs.

    Raises:
        UserError: the run was driven on the emulator, or its log format is too slow.
    """
    if run.prototype:
        raise UserError(
            f"{order.out} was driven on the emulator.", "Go on with it without --bus, or take another --out."
        )
    if order.log_format is LogFormat.MF4 and not lockstep:
        raise UserError(
            "MF4 logs are written too slowly for a cycle of 2 ms.", "Record BLF, and convert it afterwards."
        )
    if run.bus != name:
        errors.print(f"{order.out} was begun on {run.bus}, it goes on on {name}.", style="yellow")

    def may_move() -> bool:
        return not ask or typer.confirm("The vehicle will move. Is the floor free, a hand at the emergency stop?")

    clock = FreeRunningClock() if lockstep else WallClock()
    in_haste = priority and not lockstep
    if not lockstep:
        # Tried now, so that it is said before anything moves.
        with urgent(in_haste) as urgency:
            pass
        say([f"The master drives {urgency.what}."])
        say_urgency(urgency)
    with _opened(name, run.network.bit_rate) as bus, _stop_is_no_error(order.out):
        _drive(run, order, bus, clock, HumanOperator(), may_move, lockstep=lockstep, priority=in_haste)
        lost = bus.dropped if isinstance(bus, UnixBus) else 0
        if lost:
            console.print(f"{lost} frames of the bus were lost: this program did not read in time.", style="yellow")


def _drive(
    run: Run,
    order: Order,
    bus: can.BusABC,
    clock: Clock,
    operator: Operator,
    may_move: Callable[[], bool] = lambda: True,
    *,
    lockstep: bool = False,
    priority: bool = False,
    film: Video | None = None,
    told: Told | None = None,
) -> None:
    """Check the network, ask, and only then move; exit code 1 where the answer is no."""
    with driving(run.folder.path):
        console.print(loop_table(run.plan), room_table(run.plan))
        if order.resume:
            with console.status("reading the finished steps"):
                rejected = keep_unusable_aside(run)
            again = "{} is driven again: {} Its log is kept as {}."
            say((again.format(one.step, one.error.what, one.log) for one in rejected), style="yellow")
        console.print("Resetting the six nodes and asking who they are; nothing moves.")
        with console.status("looking for the six nodes"):
            check_network(bus, clock, run.network)
        console.print("All six nodes answer: identity, mode and units are those of the network file.")
        if not may_move():
            raise typer.Exit(code=1)
        with bars() as shown:
            progress = captioned(film, _bar_per_step(shown))
            if told is not None:
                told.follow, progress = progress, told
            overruns = drive_run(run, order, bus, clock, operator, progress, lockstep=lockstep, priority=priority)
    if overruns:
        console.print(f"{overruns} cycles began late: close other programs on this computer.", style="yellow")


def _bar_per_step(shown: Progress) -> Callable[[str, int, int], None]:
    """A bar for every step, and one for all attempts at an alignment, named by the present one."""
    tasks: dict[str, TaskID] = {}

    def show(step: str, done: int, total: int) -> None:
        name = step.partition(",")[0]
        if name not in tasks:
            tasks[name] = shown.add_task(step, total=total)
        shown.update(tasks[name], completed=done, total=total, description=step)

    return show


def _say_assumed(assumed: Sequence[str]) -> None:
    """What no file says of the vehicle that a rehearsal is driven on."""
    if assumed:
        console.print(
            "A rehearsal: the emulated vehicle has the priors of the vehicle file as its truth, and what no file says "
            "is assumed:"
        )
        say(f"  {line}" for line in assumed)


@contextmanager
def _opened(name: str, bit_rate: float) -> Iterator[can.BusABC]:
    bus = open_bus(name, bit_rate)
    try:
        yield bus
    finally:
        bus.shutdown()


@contextmanager
def _stop_is_no_error(out: Path) -> Iterator[None]:
    try:
        yield
    except KeyboardInterrupt:
        go_on = f"--resume --out {out}"
        errors.print(Text.assemble("Stopped, drives off. Finished steps are kept: go on with ", (go_on, "bold"), "."))
        raise typer.Exit(code=130) from None

"""The command that serves the emulated vehicle to masters in other processes."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator, Sequence
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated

import can
import typer
from rich.text import Text

from hil.bench.control import ControlServer, Injection, control_path
from hil.bus.clock import WallClock
from hil.bus.report import ListenerReport
from hil.bus.traffic import Traffic
from hil.bus.unix import UnixHub
from hil.campaign.folder import network_file_of
from hil.network import load_network
from ident.errors import UserError
from quasiomni.application import app, console
from quasiomni.filming import VIDEO_RATE, VideoOption, VideoRateOption, drawing, plan_video
from quasiomni.options import (
    DEFAULT_BUS,
    EffectOption,
    EngineOption,
    ForceOption,
    FromOption,
    GuiOption,
    NetworkOption,
    PlantOption,
    SeedOption,
    choose_engine,
    load_emulation,
    parse_effects,
    parse_plant,
    read_simulator,
    tell_native,
)
from quasiomni.paging import (
    LOOPBACK,
    PORT,
    WebHostOption,
    WebOption,
    WebPortOption,
    paging,
    plan_page,
    say_where,
    watching,
)


class Stand(StrEnum):
    """Where an emulated vehicle stands when it comes up."""

    FLOOR = "floor"
    JACK = "jack"


@app.command()
def emulate(
    bus: Annotated[
        str, typer.Option(help="INTERFACE:CHANNEL to serve, e.g. `unix:/tmp/can0` or `socketcan:can0`.")
    ] = DEFAULT_BUS,
    prototype: Annotated[str, typer.Option(help="`prototype`, `compact`, or the path of your own.")] = "prototype",
    network: NetworkOption = None,
    seed: SeedOption = 1,
    stand: Annotated[Stand, typer.Option(help="On the floor, or on the jack-stand, wheels free.")] = Stand.FLOOR,
    lockstep: Annotated[bool, typer.Option("--lockstep", help="Time moves with the master's SYNC.")] = False,
    bit_times: Annotated[
        bool, typer.Option("--bit-times", help="Frames wait for arbitration and take their bit times.")
    ] = False,
    fault: Annotated[
        list[str] | None,
        typer.Option(
            help="Fault such as `drop@0x181:rate=10%,from=2s`, or a file of them. See `can kinds`. Repeatable."
        ),
    ] = None,
    control: Annotated[
        Path | None, typer.Option(help="Socket for `can fault`. Default: beside a `unix:` bus, PATH.control.")
    ] = None,
    storage: Annotated[
        Path | None, typer.Option(help="Folder where the nodes keep parameters stored by 1010h, for the next start.")
    ] = None,
    duration: Annotated[float | None, typer.Option(min=0.0, help="Stop after so many seconds of wall time.")] = None,
    effect: EffectOption = None,
    engine: EngineOption = None,
    plant: PlantOption = None,
    simulator: FromOption = None,
    force: ForceOption = False,
    gui: GuiOption = False,
    video: VideoOption = None,
    video_rate: VideoRateOption = VIDEO_RATE,
    web: WebOption = False,
    web_host: WebHostOption = LOOPBACK,
    web_port: WebPortOption = PORT,
) -> None:
    """Serve the emulated prototype on a CAN bus, for masters in other processes. Stop it with Ctrl-C."""
    film, address = plan_video(video, video_rate, bus), plan_page(web, web_host, web_port)
    if plant is not None and simulator is not None:
        raise UserError("--from makes an emulated vehicle, --plant takes its place.", "Leave one of them out.")
    fmu, model = parse_plant(plant, force=force), read_simulator(simulator, force=force)
    chosen = choose_engine(engine) if fmu is None else None
    emulation = load_emulation()
    network_file = network or network_file_of(prototype)
    faults = emulation.read_faults(fault or [])
    end = None if duration is None else time.monotonic() + duration
    tell_native(fmu)
    with (
        paging(address) as page,
        drawing(film) as drawn,
        emulation.vehicle(
            prototype, seed, gui, network_file, parse_effects(effect), fmu, chosen, drawn, model
        ) as vehicle,
        emulation.server_bus(bus, load_network(network_file)) as opened,
    ):
        if stand is Stand.JACK:
            vehicle.lift()
        if assumed := emulation.assumed(prototype, network_file, model):
            command = f"quasiomni check {prototype}"
            console.print(Text.assemble(f"{len(assumed)} numbers of it are in no file: ", (command, "bold"), "."))
        served_as, pace = plant or simulator or prototype, "in lockstep" if lockstep else "in real time"
        console.print(f"{served_as} is up on {bus}, {pace}. Ctrl-C ends it.")
        clients, traffic = partial(_clients, opened), Traffic() if page is not None else None
        server = emulation.server(
            vehicle,
            opened,
            WallClock(),
            network_file,
            lockstep,
            seed=seed,
            delays=bit_times,
            storage=storage,
            traffic=traffic,
        )
        for one in faults:
            server.faults.add(one)
        attend: Callable[[], None] = _nobody_watches
        if page is not None and traffic is not None:
            network_shown = emulation.complete_network(prototype, network_file, model)
            attend = (
                watching().watch_server(page, str(served_as), vehicle, server, network_shown, traffic, clients).attend
            )
            say_where(page)

        def over() -> bool:
            attend()
            poll()
            return end is not None and time.monotonic() > end

        with (
            _commands(control, bus, server.faults, clients) as poll,
            contextlib.suppress(KeyboardInterrupt),
        ):
            server.serve(over)
        served = server.report
        _say_who_has_lost_frames(opened)
    console.print(f"{served.syncs} cycles served, {served.overruns} overruns, worst {served.worst_lag * 1e3:.1f} ms.")


def _nobody_watches() -> None:
    """There is no page."""


def _say_who_has_lost_frames(bus: can.BusABC) -> None:
    """Clients that did not read fast enough, those that have left included."""
    for client in _clients(bus):
        if client.dropped:
            name = f"{client.program} ({client.pid})"
            console.print(f"{name} has lost {client.dropped} frames that it did not read.", highlight=False)


def _clients(bus: can.BusABC) -> tuple[ListenerReport, ...]:
    return (*bus.listeners, *bus.departed) if isinstance(bus, UnixHub) else ()


@contextlib.contextmanager
def _commands(
    path: Path | None, bus: str, faults: Injection, clients: Callable[[], Sequence[ListenerReport]]
) -> Iterator[Callable[[], None]]:
    """Where commands are taken while the emulator serves; gives what has to be called now and then."""
    if path is None and not bus.startswith("unix:"):
        yield lambda: None
        return
    server = ControlServer(path or control_path(bus), faults, clients)
    try:
        yield server.poll
    finally:
        server.close()

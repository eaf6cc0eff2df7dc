"""The command that serves the emulated vehicle to masters in other processes."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import can
import typer
from rich.text import Text

from hil.bench.control import ControlServer, Injection, control_path
from hil.bus.clock import WallClock
from hil.bus.report import ListenerReport
from hil.bus.stamps import Stamps, write_stamps
from hil.bus.traffic import Traffic, heard_by
from hil.bus.unix import UnixHub
from hil.bus.urgency import urgent
from hil.network import load_network, network_file_of
from ident.errors import UserError
from ident.writing import refuse_folder, write_by
from quasiomni.application import app, console
from quasiomni.filming import VIDEO_RATE, VideoOption, VideoRateOption, drawing, plan_video
from quasiomni.interrupts import asked_to_end
from quasiomni.options import (
    DEFAULT_BUS,
    EffectOption,
    EngineOption,
    ForceOption,
    FromOption,
    GuiOption,
    NetworkOption,
    PlantOption,
    PriorityOption,
    SeedOption,
    choose_engine,
    load_emulation,
    parse_effects,
    parse_plant,
    read_simulator,
    say_urgency,
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
from quasiomni.scenarios import (
    JsonOption,
    JunitOption,
    ScenarioOption,
    ScenarioRun,
    Stand,
    WatchedServer,
    open_scenario,
)

if TYPE_CHECKING:
    from hil.bench.serving import VehicleServer
    from hil.page.opening import Address


@app.command()
def emulate(
    context: typer.Context,
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
    priority: PriorityOption = True,
    trace: Annotated[
        Path | None,
        typer.Option(help="Write here when the loop was where, as CSV: the newest million stamps, for `doctor`."),
    ] = None,
    scenario: ScenarioOption = None,
    junit: JunitOption = None,
    json: JsonOption = None,
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
    film = plan_video(video, video_rate, bus)
    script = open_scenario(context, scenario, (junit, json))
    address = plan_page(web, web_host, web_port)
    _refuse_together(plant, simulator, script, address)
    # The page comes up while everything else is loaded.
    with paging(address) as page:
        fmu, model = parse_plant(plant, force=force), read_simulator(simulator, force=force)
        chosen = choose_engine(engine) if fmu is None else None
        emulation = load_emulation()
        say_where(page)
        faults = emulation.read_faults(fault or [])
        if script is not None:
            prototype, network, seed = script.bench(prototype, network, seed)
            stand = script.stand(stand)
        if script is not None and script.drives_itself:
            effects = parse_effects(effect)
            script.drive(prototype, network, seed, chosen, effects, model, faults, delays=bit_times, gui=gui)
            return
        network_file = network or network_file_of(prototype)
        stamps, stamping = _stamping(trace)
        end = None if duration is None else time.monotonic() + duration
        tell_native(fmu)
        with (
            drawing(film) as drawn,
            emulation.vehicle(
                prototype, seed, gui, network_file, parse_effects(effect), fmu, chosen, drawn, model
            ) as vehicle,
            emulation.server_bus(bus, load_network(network_file)) as opened,
        ):
            if stand is Stand.JACK:
                vehicle.lift()
            _say_what_is_assumed(prototype, len(emulation.assumed(prototype, network_file, model)))
            served_as = plant or simulator or prototype
            watched = None if script is None else script.watch(vehicle, load_network(network_file))
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
                hear=heard_by([one.hear for one in (watched, traffic) if one is not None]),
                stamps=stamps,
            )
            for one in faults:
                server.faults.add(one)
            between: list[Callable[[], None]] = []
            if page is not None and traffic is not None:
                shown = emulation.complete_network(prototype, network_file, model)
                page_of = watching().watch_server(page, str(served_as), vehicle, server, shown, traffic, clients)
                between.append(page_of.attend)
            # A video is drawn between two steps, for longer than any other program should have to wait.
            in_haste = priority and not lockstep and film is None
            with (
                _commands(control, bus, server.faults, clients) as poll,
                stamping,
                urgent(in_haste) as urgency,
                asked_to_end() as asked,
            ):
                pace = "in lockstep" if lockstep else f"in real time, {urgency.what}"
                console.print(f"{served_as} is up on {bus}, {pace}. Ctrl-C ends it.", soft_wrap=True)
                say_urgency(urgency)
                _serve(server, (*between, poll), end, watched, asked)
            _say_who_has_lost_frames(opened)
        if trace is not None and stamps is not None:
            write_by(partial(write_stamps, stamps.table()), trace)
        served = server.report
        console.print(
            f"{served.syncs} cycles served, {served.overruns} overruns, worst {served.worst_lag * 1e3:.1f} ms."
        )
        if script is not None and watched is not None:
            script.end(watched.report())


def _serve(
    server: VehicleServer,
    between: Sequence[Callable[[], None]],
    end: float | None,
    watched: WatchedServer | None,
    asked: Callable[[], bool],
) -> None:
    """Serve until somebody asks for an end, an instant of the monotonic clock [s], or the end of a scenario.

    `between` is called often.
    """
    if watched is not None:
        watched.served_by(server)

    def stop() -> bool:
        for each in between:
            each()
        over = watched is not None and watched.over()
        return over or asked() or (end is not None and time.monotonic() > end)

    with contextlib.suppress(KeyboardInterrupt):
        server.serve(stop)


def _refuse_together(
    plant: str | None, simulator: Path | None, script: ScenarioRun | None, address: Address | None
) -> None:
    """Options of which each leaves no room for the other."""
    if plant is not None and simulator is not None:
        raise UserError("--from makes an emulated vehicle, --plant takes its place.", "Leave one of them out.")
    if script is not None and script.drives_itself and address is not None:
        raise UserError(
            "A scenario with set-points drives in simulated time, which no page can follow.",
            "Leave --web out, or let a master drive and have the scenario watch.",
        )


def _stamping(trace: Path | None) -> tuple[Stamps | None, contextlib.AbstractContextManager[None]]:
    """Where a trace is taken, and inside of what."""
    if trace is None:
        return None, contextlib.nullcontext()
    refuse_folder(trace)
    stamps = Stamps()
    return stamps, stamps.collections()


def _say_what_is_assumed(prototype: str, count: int) -> None:
    if count:
        command = f"quasiomni check {prototype}"
        console.print(Text.assemble(f"{count} numbers of it are in no file: ", (command, "bold"), "."))


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

"""The commands that drive a campaign: on the emulator, or on a real vehicle."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import can
import typer
from rich.progress import Progress, TaskID
from rich.text import Text

from hil.bus.clock import Clock, FreeRunningClock, WallClock
from hil.bus.opening import open_bus
from hil.campaign.driving import drive_run, keep_unusable_aside
from hil.campaign.folder import Run, carries_vehicle, open_run
from hil.campaign.lock import driving
from hil.campaign.order import Order, plan_run, refuse_changed
from hil.campaign.results import identify_run
from hil.campaign.runner import Operator, check_network
from hil.frames.recorder import LogFormat
from ident.campaign.steps import DRIVING_ORDER, LOADED, ORDER, PERIODS
from ident.effects import Effect
from ident.errors import UserError
from ident.extras import EngineName, Extra, require
from ident.records.record import Step, base_step
from ident.report.tables import loop_table, room_table
from ident.vehicle.description import find_data_file
from quasiomni.application import app, console, errors, show_next
from quasiomni.filming import AT_REST, VIDEO_RATE, VideoOption, VideoRateOption, captioned, drawing, plan_video
from quasiomni.identification import end_with, known_inertia
from quasiomni.options import (
    EffectOption,
    EngineOption,
    ForceOption,
    FromOption,
    GuiOption,
    InertiaOption,
    InertiaStdOption,
    NetworkOption,
    PlantOption,
    SeedOption,
    VehicleOption,
    choose_engine,
    load_emulation,
    parse_effects,
    parse_plant,
    read_simulator,
    tell_native,
    truth_of,
)
from quasiomni.showing import HumanOperator, bar, bars, say, stages

if TYPE_CHECKING:
    from hil.video.film import Video

LOCKSTEP = "emulator, in lockstep"


@app.command()
def demo(
    out: Annotated[Path, typer.Option(help="Run folder to write.")] = Path("runs/demo"),
    vehicle: VehicleOption = "prototype",
    engine: EngineOption = None,
    seed: SeedOption = 1,
    effect: EffectOption = None,
    gui: GuiOption = False,
    video: VideoOption = None,
    video_rate: VideoRateOption = VIDEO_RATE,
) -> None:
    """The whole story on the emulator: boot, four steps, parameters beside the truth, lane change, report."""
    film = plan_video(video, video_rate, AT_REST)
    chosen = choose_engine(engine)
    steps = _steps((), False, None)
    order = Order(
        out, vehicle, None, steps, PERIODS, seed, None, LogFormat.BLF, LOCKSTEP, vehicle, demo=True, engine=chosen
    )
    effects = parse_effects(effect)
    _drive_on_emulator(_planned(order), order, effects, gui, film)
    with stages() as stage:
        result = identify_run(out, out, None, truth_of(vehicle), stage=stage)
    end_with(result, out)


@app.command()
def campaign(
    context: typer.Context,
    out: Annotated[Path, typer.Option(help="Run folder to write, or to go on with.")] = Path("runs/campaign"),
    bus: Annotated[
        str | None,
        typer.Option(help="INTERFACE:CHANNEL of the real vehicle, e.g. `socketcan:can0`. Default: the emulator."),
    ] = None,
    vehicle: VehicleOption = "prototype",
    network: NetworkOption = None,
    skip: Annotated[list[Step] | None, typer.Option(help="Leave out a step; repeat the option for more.")] = None,
    lateral: Annotated[bool, typer.Option("--lateral", help="Drive the optional lateral step too.")] = False,
    diagnostic: Annotated[
        bool, typer.Option("--diagnostic", help="Drive the steps that show what the four steps cannot; see the docs.")
    ] = False,
    payload: Annotated[
        float, typer.Option(min=0.0, help="With --diagnostic: a known load [kg] that the operator puts on.")
    ] = 0.0,
    periods: Annotated[int, typer.Option(help="Repeats of every excitation, at least 4.")] = PERIODS,
    seed: SeedOption = 1,
    b_w: InertiaOption = None,
    b_w_std: InertiaStdOption = None,
    log_format: Annotated[LogFormat, typer.Option("--format", help="Format of the logs.")] = LogFormat.BLF,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the run in --out where it stopped.")] = False,
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask before the vehicle moves.")] = False,
    lockstep: Annotated[
        bool, typer.Option("--lockstep", help="With --bus: the other side is an emulator that SYNC moves.")
    ] = False,
    engine: EngineOption = None,
    effect: EffectOption = None,
    plant: PlantOption = None,
    simulator: FromOption = None,
    force: ForceOption = False,
    gui: GuiOption = False,
    video: VideoOption = None,
    video_rate: VideoRateOption = VIDEO_RATE,
) -> None:
    """Drive the identification steps and record every frame; on the emulator, or with --bus on a real vehicle.

    Nothing moves before all six nodes have answered with the expected identity, mode and units, and you have seen
    the room it takes. A run that was stopped keeps its finished steps: go on with --resume.
    """
    if payload and not diagnostic:
        raise UserError("--payload is of the diagnostic steps.", "Add --diagnostic, or leave it out.")
    steps: tuple[str, ...] = _steps(skip or (), lateral, b_w)
    if diagnostic:
        steps = _diagnostic_steps(skip or (), payload)
    inertia = known_inertia(b_w, b_w_std)
    effects, fmu = parse_effects(effect), parse_plant(plant, force=force)
    _refuse_two_vehicles(bus, fmu, effects, engine, video, simulator)
    film = plan_video(video, video_rate, AT_REST)
    read_simulator(simulator, force=force)
    if log_format is LogFormat.MF4:
        require(Extra.RECORDS, "--format .mf4", ("asammdf",))
    prototype, where = (vehicle, LOCKSTEP) if bus is None and plant is None else ("", bus or plant or "")
    order = Order(
        out,
        vehicle,
        network,
        steps,
        periods,
        seed,
        inertia,
        log_format,
        where,
        prototype,
        payload,
        resume,
        engine=engine,
        simulator=simulator,
    )
    run = _resumed(order, context) if resume else _planned(_on_engine(order))
    if fmu is not None:
        same = not resume or carries_vehicle(run.folder, find_data_file("ident.vehicle", vehicle))
        _drive_on_fmu(run, order, vehicle if same else str(run.folder.vehicle), fmu)
    elif bus is None:
        _drive_on_emulator(run, order, effects, gui, film, force=force)
    else:
        _drive_on_bus(run, order, bus, ask=not yes, lockstep=lockstep)
    show_next(f"quasiomni identify {out}")


def _on_engine(order: Order) -> Order:
    """The order with the engine of its emulated vehicle, if that is what it is driven on."""
    return replace(order, engine=choose_engine(order.engine)) if order.prototype else order


def _refuse_two_vehicles(
    bus: str | None,
    fmu: Path | None,
    effects: Sequence[Effect],
    engine: EngineName | None,
    video: Path | None,
    simulator: Path | None,
) -> None:
    if bus is not None and (effects or fmu or engine or video or simulator):
        raise UserError(
            "--effect, --engine, --from, --plant and --video are of the emulator, and --bus names another vehicle.",
            "Leave one of them out.",
        )
    if fmu is not None and (engine or video or simulator):
        raise UserError(
            "--plant takes the place of the emulated vehicle that --engine, --from and --video are of.",
            "Leave one of them out.",
        )


def _planned(order: Order) -> Run:
    with bar("optimising the excitation") as planned:
        return plan_run(order, planned)


def _resumed(order: Order, context: typer.Context) -> Run:
    """The run to go on with; options that contradict it are refused."""
    run = open_run(order.out)
    sources = {name: context.get_parameter_source(name) for name in context.params}
    given = {name for name, source in sources.items() if source is not None and source.name == "COMMANDLINE"}
    refuse_changed(run, order, given)
    return run


def _drive_on_emulator(
    run: Run, order: Order, effects: Sequence[Effect], gui: bool, film: Video | None, *, force: bool = False
) -> None:
    if not run.prototype:
        raise UserError(
            f"{order.out} was driven on {run.bus}, not on the emulator.", f"Go on with it there: --bus {run.bus}."
        )
    emulation = load_emulation()
    engine = choose_engine(run.engine) if order.resume else run.engine
    network, simulator = run.network.path, read_simulator(run.simulator, force=force)
    _say_assumed(emulation.assumed(run.emulated, network, simulator))
    with (
        drawing(film) as video,
        emulation.bench(
            run.emulated, run.seed, gui, network, effects, engine=engine, video=video, simulator=simulator
        ) as bench,
        _stop_is_no_error(order.out),
    ):
        _drive(run, order, bench.bus, bench.clock, bench.operator, film=film)


def _drive_on_fmu(run: Run, order: Order, prototype: str, fmu: Path) -> None:
    tell_native(fmu)
    bench = load_emulation().bench(prototype, run.seed, False, run.network.path, fmu=fmu)
    with bench as opened, _stop_is_no_error(order.out):
        _drive(run, order, opened.bus, opened.clock, opened.operator)


def _drive_on_bus(run: Run, order: Order, name: str, *, ask: bool, lockstep: bool) -> None:
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
    with _opened(name, run.network.bit_rate) as bus, _stop_is_no_error(order.out):
        _drive(run, order, bus, clock, HumanOperator(), may_move, lockstep=lockstep)


def _drive(
    run: Run,
    order: Order,
    bus: can.BusABC,
    clock: Clock,
    operator: Operator,
    may_move: Callable[[], bool] = lambda: True,
    *,
    lockstep: bool = False,
    film: Video | None = None,
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
            overruns = drive_run(run, order, bus, clock, operator, progress, lockstep=lockstep)
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


def _steps(skip: Sequence[Step], lateral: bool, b_w: float | None) -> tuple[Step, ...]:
    left_out = {*skip, *([] if lateral else [Step.LATERAL]), *([] if b_w is None else [Step.WHEEL_LIFTED])}
    return tuple(step for step in ORDER if step not in left_out)


def _diagnostic_steps(skip: Sequence[Step], payload: float) -> tuple[str, ...]:
    """All steps but those skipped, their variants with them; wheels lifted even where B_w is given."""
    return tuple(step for step in DRIVING_ORDER if base_step(step) not in skip and (payload > 0 or step not in LOADED))

"""The commands that drive a campaign: on the emulator, an FMU, or a real vehicle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hil.campaign.folder import Run, carries_vehicle, open_run
from hil.campaign.order import Order, plan_run, refuse_changed
from hil.campaign.results import identify_run
from hil.frames.recorder import LogFormat
from ident.campaign.steps import DRIVING_ORDER, LOADED, ORDER, PERIODS
from ident.effects import Effect
from ident.errors import UserError
from ident.extras import EngineName, Extra, require
from ident.records.record import Step, base_step
from ident.vehicle.description import find_data_file
from quasiomni.application import app, show_next
from quasiomni.behind_the_bus import drive_on_bus, drive_on_emulator, drive_on_fmu
from quasiomni.filming import AT_REST, VIDEO_RATE, VideoOption, VideoRateOption, plan_video
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
    PriorityOption,
    SeedOption,
    VehicleOption,
    choose_engine,
    parse_effects,
    parse_plant,
    read_simulator,
    truth_of,
)
from quasiomni.paging import LOOPBACK, PORT, WebHostOption, WebOption, WebPortOption, plan_page
from quasiomni.showing import bar, stages

if TYPE_CHECKING:
    pass

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
    drive_on_emulator(_planned(order), order, effects, gui, film)
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
    priority: PriorityOption = True,
    engine: EngineOption = None,
    effect: EffectOption = None,
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
    effects, fmu = parse_effects(effect), parse_plant(plant, force=force, on_bus=True)
    _refuse_two_vehicles(bus, fmu, effects, engine, video, simulator, web)
    film, page = plan_video(video, video_rate, AT_REST), plan_page(web, web_host, web_port)
    read_simulator(simulator, force=force)
    if log_format is LogFormat.MF4:
        require(Extra.RECORDS, "--format .mf4", ("asammdf",))
    if log_format is LogFormat.MCAP:
        require(Extra.MCAP, "--format .mcap")
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
        prototype = vehicle if same else str(run.folder.vehicle)
        drive_on_fmu(run, order, prototype, fmu, own_devices=str(plant).startswith("fmu-bus:"))
    elif bus is None:
        drive_on_emulator(run, order, effects, gui, film, force=force, page=page)
    else:
        drive_on_bus(run, order, bus, ask=not yes, lockstep=lockstep, priority=priority)
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
    web: bool,
) -> None:
    if bus is not None and (effects or fmu or engine or video or simulator or web):
        raise UserError(
            "--effect, --engine, --from, --plant, --video, --web are of the emulator, and --bus names another vehicle.",
            "Leave one of them out.",
        )
    if fmu is not None and (engine or video or simulator or web):
        raise UserError(
            "--plant takes the place of the emulated vehicle that --engine, --from, --video and --web are of.",
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


def _steps(skip: Sequence[Step], lateral: bool, b_w: float | None) -> tuple[Step, ...]:
    left_out = {*skip, *([] if lateral else [Step.LATERAL]), *([] if b_w is None else [Step.WHEEL_LIFTED])}
    return tuple(step for step in ORDER if step not in left_out)


def _diagnostic_steps(skip: Sequence[Step], payload: float) -> tuple[str, ...]:
    """All steps but those skipped, their variants with them; wheels lifted even where B_w is given."""
    return tuple(step for step in DRIVING_ORDER if base_step(step) not in skip and (payload > 0 or step not in LOADED))

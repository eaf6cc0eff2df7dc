"""The commands around one campaign: drive it, identify it, report it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import can
import typer
from rich.markup import escape

from hil import workflow
from hil.buses import open_bus
from hil.campaign.folder import Run, RunFolder, open_run
from hil.clock import FreeRunningClock, WallClock
from hil.recorder import LogFormat
from hil.workflow import HumanOperator, Order
from ident.campaign.steps import DRIVING_ORDER, LOADED, ORDER, PERIODS
from ident.errors import UserError
from ident.estimate.identify import KnownInertia
from ident.records.record import Step, base_step
from ident.vehicle.effects import Effect
from ident.vehicle.parameters import Parameters
from quasiomni.application import app, console, errors
from quasiomni.options import (
    EffectOption,
    GuiOption,
    InertiaOption,
    InertiaStdOption,
    NetworkOption,
    PlantOption,
    SeedOption,
    VehicleOption,
    load_emulation,
    parse_effects,
    parse_plant,
)

LOCKSTEP = "emulator, in lockstep"


@app.command()
def demo(
    out: Annotated[Path, typer.Option(help="Run folder to write.")] = Path("runs/demo"),
    vehicle: VehicleOption = "prototype",
    seed: SeedOption = 1,
    effect: EffectOption = None,
    gui: GuiOption = False,
) -> None:
    """The whole story on the emulator: boot, four steps, parameters beside the truth, lane change, report."""
    _clear_previous(out)
    order = Order(out, vehicle, None, _steps((), False, None), PERIODS, seed, None, LogFormat.BLF, LOCKSTEP, vehicle)
    effects = parse_effects(effect)
    _drive_on_emulator(workflow.plan_run(order, console), order, effects, gui)
    workflow.identify_run(out, out, None, _truth(vehicle), console)


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
    effect: EffectOption = None,
    plant: PlantOption = None,
    gui: GuiOption = False,
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
    inertia = _known_inertia(b_w, b_w_std)
    effects, fmu = parse_effects(effect), parse_plant(plant)
    if bus is not None and (effects or fmu):
        raise UserError(
            "--effect and --plant are of the emulator, and --bus names another vehicle.", "Leave one of them out."
        )
    prototype, where = (vehicle, LOCKSTEP) if bus is None and plant is None else ("", bus or plant or "")
    order = Order(out, vehicle, network, steps, periods, seed, inertia, log_format, where, prototype, payload)
    run = _resumed(order, context) if resume else workflow.plan_run(order, console)
    if fmu is not None:
        _drive_on_fmu(run, order, vehicle, fmu)
    elif bus is None:
        _drive_on_emulator(run, order, effects, gui)
    else:
        _drive_on_bus(run, order, bus, ask=not yes, lockstep=lockstep)
    console.print(f"Next: [bold]quasiomni identify {out}[/bold]")


@app.command()
def identify(
    records: Annotated[
        list[Path], typer.Argument(help="Run folder, logs named NNN_step.blf, or CSV, Parquet or MF4 records.")
    ],
    vehicle: VehicleOption = "prototype",
    network: NetworkOption = None,
    b_w: InertiaOption = None,
    b_w_std: InertiaStdOption = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for parameters.toml and report.html. Default: the run folder, or here.")
    ] = None,
) -> None:
    """Identify the parameters from recorded frames or records alone; writes parameters.toml and report.html."""
    inertia = _known_inertia(b_w, b_w_std)
    if len(records) == 1 and RunFolder(records[0]).manifest.is_file():
        workflow.identify_run(records[0], out or records[0], inertia, None, console)
    else:
        workflow.identify_records(records, vehicle, network, inertia, out or Path(), console)


@app.command()
def report(
    run: Annotated[Path, typer.Argument(help="Run folder.")],
    out: Annotated[Path | None, typer.Option(help="File to write. Default: report.html in the run folder.")] = None,
) -> None:
    """Write the HTML report of a run again, from its frames."""
    prototype = open_run(run).prototype
    workflow.report_run(run, out or RunFolder(run).report, _truth(prototype) if prototype else None, console)


def _resumed(order: Order, context: typer.Context) -> Run:
    """The run to go on with; options that contradict it are refused."""
    run = open_run(order.out)
    sources = {name: context.get_parameter_source(name) for name in context.params}
    given = {name for name, source in sources.items() if source is not None and source.name == "COMMANDLINE"}
    workflow.refuse_changed(run, order, given)
    return run


def _drive_on_emulator(run: Run, order: Order, effects: Sequence[Effect], gui: bool) -> None:
    if not run.prototype:
        raise UserError(
            f"{order.out} was driven on {run.bus}, not on the emulator.", f"Go on with it there: --bus {run.bus}."
        )
    emulation = load_emulation()
    network = run.network.path
    with emulation.bench(run.prototype, run.seed, gui, network, effects) as bench, _stop_is_no_error(order.out):
        workflow.drive_run(run, order, bench.bus, bench.clock, bench.operator, console, lambda: True)


def _drive_on_fmu(run: Run, order: Order, prototype: str, fmu: Path) -> None:
    bench = load_emulation().bench(prototype, run.seed, False, run.network.path, fmu=fmu)
    with bench as opened, _stop_is_no_error(order.out):
        workflow.drive_run(run, order, opened.bus, opened.clock, opened.operator, console, lambda: True)


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
        errors.print(f"[yellow]{escape(str(order.out))} was begun on {run.bus}, it goes on on {name}.[/yellow]")

    def may_move() -> bool:
        return not ask or typer.confirm("The vehicle will move. Is the floor free, a hand at the emergency stop?")

    clock = FreeRunningClock() if lockstep else WallClock()
    with _opened(name, run.network.bit_rate) as bus, _stop_is_no_error(order.out):
        if not workflow.drive_run(run, order, bus, clock, HumanOperator(console), console, may_move):
            raise typer.Exit(code=1)


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
        errors.print(f"Stopped, drives off. Finished steps are kept: go on with [bold]--resume --out {out}[/bold].")
        raise typer.Exit(code=130) from None


def _truth(prototype: str) -> Parameters:
    """What the emulated prototype was built with; needs its data file, not the engine."""
    from hil.truth import truth_of

    return truth_of(prototype)


def _steps(skip: Sequence[Step], lateral: bool, b_w: float | None) -> tuple[Step, ...]:
    left_out = {*skip, *([] if lateral else [Step.LATERAL]), *([] if b_w is None else [Step.WHEEL_LIFTED])}
    return tuple(step for step in ORDER if step not in left_out)


def _diagnostic_steps(skip: Sequence[Step], payload: float) -> tuple[str, ...]:
    """All steps but those skipped, their variants with them; wheels lifted even where B_w is given."""
    return tuple(step for step in DRIVING_ORDER if base_step(step) not in skip and (payload > 0 or step not in LOADED))


def _known_inertia(value: float | None, std: float | None) -> KnownInertia | None:
    if value is None:
        if std is not None:
            raise UserError("B_w's standard deviation is given without B_w.", "Add --b-w, or leave --b-w-std out.")
        return None
    if std is None:
        raise UserError("B_w is given without its standard deviation.", "Add --b-w-std: every result depends on it.")
    if not (value > 0 and 0 <= std < value):
        raise UserError(f"B_w = {value} ± {std} kg m² cannot be.", "Give a positive value and a smaller deviation.")
    return KnownInertia(value, std, "given")


def _clear_previous(out: Path) -> None:
    """The demo starts afresh: logs and manifest of an earlier demo go, anything else stays."""
    folder = RunFolder(out)
    if folder.manifest.is_file():
        for log in folder.frames.glob("[0-9][0-9][0-9]_*"):
            log.unlink()
        folder.manifest.unlink()

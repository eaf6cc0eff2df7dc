"""The command line: composes vehicle, bus, campaign, estimate and report. Everything it does lives elsewhere."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from enum import StrEnum
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from hil.buses.opening import open_bus
from hil.campaign.folder import Run, RunFolder, create_run, network_file_of, open_run, refuse_used
from hil.campaign.reading import join, read_any, read_run
from hil.campaign.runner import CampaignRunner, Operator, check_network
from hil.clock import Clock, FreeRunningClock, WallClock
from hil.network import load_network
from hil.recorder import LogFormat, Recorder
from ident.campaign.plan import Plan, make_plan
from ident.campaign.steps import ORDER
from ident.errors import BusError, CampaignError, UserError
from ident.estimate.identify import Identification, KnownInertia, identify
from ident.estimate.result_file import write_parameters
from ident.records.record import Record, Step
from ident.report.html import ReportContent, write_report
from ident.report.tables import (
    condition_line,
    excitation_table,
    loop_table,
    paper_table,
    parameter_table,
    room_table,
    step_table,
)
from ident.vehicle.description import VehicleDescription, find_data_file, load_vehicle
from ident.vehicle.parameters import Parameters

app = typer.Typer(
    help="From prototype to trusted model: dynamic identification of quasi-omnidirectional platforms over CAN.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=False,
    rich_markup_mode="markdown",
)
console = Console()
errors = Console(stderr=True)

PAPER_PROTOTYPE = "prototype"
"""Name of the vehicle that Table 2 of the paper describes."""

DEFAULT_STEPS = tuple(step for step in ORDER if step is not Step.LATERAL)

VehicleOption = Annotated[
    str, typer.Option("--vehicle", help="Vehicle file: `prototype`, `compact`, or the path of your own.")
]
NetworkOption = Annotated[
    Path | None, typer.Option("--network", help="Network file: nodes, units, directions. Default: the vehicle's.")
]
InertiaOption = Annotated[float | None, typer.Option("--b-w", help="Give B_w [kg m²] instead of lifting the wheels.")]
InertiaStdOption = Annotated[
    float | None, typer.Option("--b-w-std", help="Standard deviation of the B_w given [kg m²]; needed with --b-w.")
]
SeedOption = Annotated[int, typer.Option(help="Seed of the excitation and of all emulated noise.")]


class Stand(StrEnum):
    """Where an emulated vehicle stands when it comes up."""

    FLOOR = "floor"
    JACK = "jack"


@app.command()
def demo(
    out: Annotated[Path, typer.Option(help="Run folder to write.")] = Path("runs/demo"),
    vehicle: VehicleOption = "prototype",
    seed: SeedOption = 1,
    gui: Annotated[bool, typer.Option("--gui", help="Show the vehicle in a window.")] = False,
) -> None:
    """The whole story on the emulator: boot, four steps, parameters beside the truth, lane change, report."""
    _replace_previous(out)
    _campaign_on_emulator(out, vehicle, None, seed, DEFAULT_STEPS, 4, LogFormat.BLF, None, gui, resume=False)
    _identify_run(out, compare_with_truth=True)


@app.command()
def campaign(
    out: Annotated[Path, typer.Option(help="Run folder to write, or to go on with.")] = Path("runs/campaign"),
    bus: Annotated[
        str | None,
        typer.Option(help="INTERFACE:CHANNEL of the real vehicle, e.g. `socketcan:can0`. Default: the emulator."),
    ] = None,
    vehicle: VehicleOption = "prototype",
    network: NetworkOption = None,
    skip: Annotated[list[Step] | None, typer.Option(help="Leave out a step; repeat the option for more.")] = None,
    lateral: Annotated[bool, typer.Option("--lateral", help="Drive the optional lateral step too.")] = False,
    periods: Annotated[int, typer.Option(help="Repeats of every excitation, at least 4.")] = 4,
    seed: SeedOption = 1,
    b_w: InertiaOption = None,
    b_w_std: InertiaStdOption = None,
    log_format: Annotated[LogFormat, typer.Option("--format", help="Format of the logs.")] = LogFormat.BLF,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the run in --out where it stopped.")] = False,
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask before the vehicle moves.")] = False,
    lockstep: Annotated[
        bool, typer.Option("--lockstep", help="With --bus: the other side is an emulator that SYNC moves.")
    ] = False,
    gui: Annotated[bool, typer.Option("--gui", help="Show the emulated vehicle in a window.")] = False,
) -> None:
    """Drive the identification steps and record every frame; on the emulator, or with --bus on a real vehicle.

    Nothing moves before all six nodes have answered with the expected identity, mode and units, and you have seen
    the room it takes. A run that was stopped keeps its finished steps: go on with --resume.
    """
    steps = _steps(skip or [], lateral, b_w)
    inertia = _known_inertia(b_w, b_w_std)
    if bus is None:
        _campaign_on_emulator(out, vehicle, network, seed, steps, periods, log_format, inertia, gui, resume)
    else:
        run = _prepare(out, vehicle, network, seed, steps, periods, inertia, bus, "", resume)
        clock: Clock = FreeRunningClock() if lockstep else WallClock()
        with contextlib.closing(_Shut(open_bus(bus, run.network.bit_rate))) as opened:
            _drive(run, opened.bus, clock, HumanOperator(), log_format, vehicle, ask=not yes)
    console.print(f"Next: [bold]quasiomni identify {out}[/bold]")


@app.command(name="identify")
def identify_command(
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
        _identify_run(records[0], compare_with_truth=False, inertia=inertia, out=out)
        return
    described = load_vehicle(vehicle)
    joined = join([read_any(path, load_network(_network_file(vehicle, network))) for path in records])
    _identify(
        joined, described, inertia, out or Path(), {"record": joined.source, "vehicle": described.name}, None, None
    )


@app.command()
def report(
    run: Annotated[Path, typer.Argument(help="Run folder.")],
    out: Annotated[Path | None, typer.Option(help="File to write. Default: report.html in the run folder.")] = None,
) -> None:
    """Write the HTML report of a run again, from its frames."""
    target = out or RunFolder(run).report
    opened = open_run(run)
    record = _read_run(run)
    result = identify(record, opened.plan.vehicle.geometry, known_inertia=opened.known_inertia)
    content = _content(record, result, opened.plan.vehicle, _provenance(opened), _truth(opened), opened.plan)
    write_report(content, target)
    console.print(f"Written: {target}")


@app.command()
def emulate(
    bus: Annotated[str, typer.Option(help="INTERFACE:CHANNEL to serve, e.g. `unix:/tmp/can0` or `socketcan:can0`.")],
    prototype: Annotated[str, typer.Option(help="`prototype`, `compact`, or the path of your own.")] = "prototype",
    network: NetworkOption = None,
    seed: SeedOption = 1,
    stand: Annotated[
        Stand, typer.Option(help="On the floor, or on the jack-stand with its wheels free.")
    ] = Stand.FLOOR,
    lockstep: Annotated[bool, typer.Option("--lockstep", help="Time moves with the master's SYNC.")] = False,
    duration: Annotated[float | None, typer.Option(help="Stop after so many seconds of wall time.")] = None,
    gui: Annotated[bool, typer.Option("--gui", help="Show the vehicle in a window.")] = False,
) -> None:
    """Serve the emulated prototype on a CAN bus, for masters in other processes. Stop it with Ctrl-C."""
    emulator = _emulator()
    network_file = _network_file(prototype, network)
    end = None if duration is None else time.monotonic() + duration
    with (
        emulator.vehicle(prototype, seed, gui) as vehicle,
        emulator.server_bus(bus, load_network(network_file)) as opened,
    ):
        if stand is Stand.JACK:
            vehicle.lift()
        console.print(f"{prototype} is up on {bus}, {'in lockstep' if lockstep else 'in real time'}. Ctrl-C ends it.")
        server = emulator.server(vehicle, opened, WallClock(), network_file, lockstep)
        with contextlib.suppress(KeyboardInterrupt):
            server.serve(lambda: end is not None and time.monotonic() > end)
        served = server.report
    console.print(f"{served.syncs} cycles served, {served.overruns} overruns, worst {served.worst_lag * 1e3:.1f} ms.")


class HumanOperator:
    """Asks the person beside the vehicle to lift and lower it."""

    def lift(self) -> None:
        """Ask for the jack-stand."""
        self._ask("Put the vehicle on its jack-stand, all four wheels free to turn")

    def lower(self) -> None:
        """Ask for the floor."""
        self._ask("Put the vehicle on the floor, wheels about straight ahead")

    def _ask(self, what: str) -> None:
        if not sys.stdin.isatty():
            raise CampaignError(
                f"{what}: that needs a person at a terminal.", "Or give B_w: --b-w VALUE --b-w-std STD."
            )
        console.input(f"[bold]{what}[/bold], then press Enter. ")


class _Shut:
    """A bus whose `close` takes it off the wire."""

    def __init__(self, bus: Any) -> None:
        self.bus = bus

    def close(self) -> None:
        self.bus.shutdown()


def _emulator() -> Any:
    """The emulated side, loaded only where it is asked for."""
    try:
        from hil import emulation
    except ImportError as error:
        raise UserError(
            f"The emulator is not installed ({error.name}).", "Install it: pip install 'quasiomni[emulator]'."
        ) from error
    return emulation


def _campaign_on_emulator(
    out: Path,
    vehicle: str,
    network: Path | None,
    seed: int,
    steps: Sequence[Step],
    periods: int,
    log_format: LogFormat,
    inertia: KnownInertia | None,
    gui: bool,
    resume: bool,
) -> None:
    emulator = _emulator()
    run = _prepare(out, vehicle, network, seed, steps, periods, inertia, "emulator, in lockstep", vehicle, resume)
    with emulator.bench(run.prototype, run.seed, gui, run.network.path) as bench:
        _drive(run, bench.bus, bench.clock, bench.operator, log_format, vehicle, ask=False)


def _prepare(
    out: Path,
    vehicle: str,
    network: Path | None,
    seed: int,
    steps: Sequence[Step],
    periods: int,
    inertia: KnownInertia | None,
    bus: str,
    prototype: str,
    resume: bool,
) -> Run:
    if resume:
        return open_run(out)
    refuse_used(RunFolder(out))
    described, network_file = load_vehicle(vehicle), _network_file(vehicle, network)
    loaded = load_network(network_file)
    plan = _plan(described, steps, periods, loaded.cycle_period, seed)
    return Run(RunFolder(out), plan, loaded, seed, bus, prototype, inertia)


def _plan(vehicle: VehicleDescription, steps: Sequence[Step], periods: int, cycle: float, seed: int) -> Plan:
    with _progress() as bars:
        task = bars.add_task("optimising the excitation", total=sum(step is not Step.LANE_CHANGE for step in steps))
        return make_plan(
            vehicle,
            np.random.default_rng(seed),
            steps=steps,
            periods=periods,
            cycle=cycle,
            progress=lambda _: bars.advance(task),
        )


def _drive(
    run: Run, bus: Any, clock: Clock, operator: Operator, log_format: LogFormat, vehicle: str, *, ask: bool
) -> None:
    """Check, ask, and only then make the run folder and move."""
    console.print(loop_table(run.plan), room_table(run.plan))
    with console.status("looking for the six nodes"):
        check_network(bus, clock, run.network)
    console.print("All six nodes answer: identity, mode and units are those of the network file.")
    if ask and not typer.confirm("The vehicle will move. Is the floor free, and a hand at the emergency stop?"):
        raise typer.Exit(code=1)
    if not run.folder.manifest.is_file():
        create_run(run, find_data_file("ident.vehicle", vehicle))
    recorder = Recorder(run.folder.frames, log_format)
    try:
        with _progress() as bars:
            runner = CampaignRunner(run, bus, clock, recorder, operator, _bar(bars))
            runner.drive()
    except KeyboardInterrupt:
        errors.print(f"Stopped. Finished steps are kept: go on with [bold]--resume --out {run.folder.path}[/bold].")
        raise typer.Exit(code=130) from None
    finally:
        recorder.close()
    if runner.overruns:
        errors.print(f"[yellow]{runner.overruns} cycles began late: close other programs on this computer.[/yellow]")


def _bar(bars: Progress) -> Callable[[str, int, int], None]:
    tasks: dict[str, Any] = {}

    def show(step: str, done: int, total: int) -> None:
        if step not in tasks:
            tasks[step] = bars.add_task(step, total=total)
        bars.update(tasks[step], completed=done, total=total)

    return show


def _identify_run(
    folder: Path, *, compare_with_truth: bool, inertia: KnownInertia | None = None, out: Path | None = None
) -> None:
    run = open_run(folder)
    truth = _truth(run) if compare_with_truth else None
    record = _read_run(folder)
    _identify(record, run.plan.vehicle, inertia or run.known_inertia, out or folder, _provenance(run), truth, run.plan)


def _identify(
    record: Record,
    vehicle: VehicleDescription,
    inertia: KnownInertia | None,
    out: Path,
    provenance: dict[str, str],
    truth: Parameters | None,
    plan: Plan | None,
) -> None:
    with console.status("identifying"):
        result = identify(record, vehicle.geometry, known_inertia=inertia)
    console.print(parameter_table(result, truth), excitation_table(result), step_table(result))
    if _is_paper_prototype(vehicle):
        console.print(paper_table(result))
    console.print(condition_line(result))
    out.mkdir(parents=True, exist_ok=True)
    write_parameters(result, out / "parameters.toml", provenance)
    with console.status("writing the report"):
        write_report(_content(record, result, vehicle, provenance, truth, plan), out / "report.html")
    console.print(f"Written: {out / 'parameters.toml'}, {out / 'report.html'}")


def _content(
    record: Record,
    result: Identification,
    vehicle: VehicleDescription,
    provenance: dict[str, str],
    truth: Parameters | None,
    plan: Plan | None,
) -> ReportContent:
    title = f"Identification of {vehicle.name}"
    return ReportContent(
        title, result, record, vehicle, truth, plan, provenance, warnings=(), paper=_is_paper_prototype(vehicle)
    )


def _is_paper_prototype(vehicle: VehicleDescription) -> bool:
    """Whether Table 2 of the paper has anything to say about the vehicle."""
    return vehicle.name == PAPER_PROTOTYPE


def _read_run(folder: Path) -> Record:
    with console.status("decoding the frames"):
        return read_run(folder)


def _provenance(run: Run) -> dict[str, str]:
    return {
        "run": run.folder.path.name,
        "vehicle": run.plan.vehicle.name,
        "bus": run.bus,
        "seed": str(run.seed),
        "quasiomni": version("quasiomni"),
    }


def _truth(run: Run) -> Parameters | None:
    """What the emulator was built with; None for a real vehicle."""
    return _emulator().truth(run.prototype) if run.prototype else None


def _steps(skip: Sequence[Step], lateral: bool, b_w: float | None) -> tuple[Step, ...]:
    left_out = {*skip, *([] if lateral else [Step.LATERAL]), *([] if b_w is None else [Step.WHEEL_LIFTED])}
    return tuple(step for step in ORDER if step not in left_out)


def _known_inertia(value: float | None, std: float | None) -> KnownInertia | None:
    if value is None:
        return None
    if std is None:
        raise UserError("B_w is given without its standard deviation.", "Add --b-w-std: every result depends on it.")
    if not (value > 0 and 0 <= std < value):
        raise UserError(f"B_w = {value} ± {std} kg m² cannot be.", "Give a positive value and a smaller deviation.")
    return KnownInertia(value, std, "given")


def _network_file(vehicle: str, network: Path | None) -> Path:
    return network if network is not None else network_file_of(vehicle)


def _replace_previous(out: Path) -> None:
    """The demo starts afresh: files of an earlier demo go, anything else stays."""
    folder = RunFolder(out)
    if folder.manifest.is_file():
        for log in folder.frames.glob("[0-9][0-9][0-9]_*"):
            log.unlink()
        folder.manifest.unlink()


@contextmanager
def _progress() -> Iterator[Progress]:
    columns = (SpinnerColumn(), TextColumn("{task.description:<24}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console) as bars:
        yield bars


def main() -> None:
    """Entry point: user errors become one line each and exit code 2."""
    try:
        app()
    except UserError as error:
        label = "bus" if isinstance(error, BusError) else "error"
        errors.print(f"[bold red]{label}:[/bold red] {error.what}", highlight=False)
        errors.print(f"[bold]remedy:[/bold] {error.remedy}", highlight=False)
        sys.exit(2)


if __name__ == "__main__":
    main()

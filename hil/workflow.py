"""What the commands do, with everything shown on a console that is passed in."""

from __future__ import annotations

import sys
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import can
import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TaskID, TextColumn, TimeElapsedColumn

from hil.campaign.folder import Run, RunFolder, create_run, network_file_of, open_run, refuse_used
from hil.campaign.reading import join, read_any, read_run
from hil.campaign.runner import CampaignRunner, Operator, check_network
from hil.clock import Clock
from hil.network import load_network
from hil.recorder import LogFormat, Recorder
from ident.campaign.plan import Plan, make_plan
from ident.campaign.steps import DIAGNOSTIC
from ident.errors import CampaignError, UserError
from ident.estimate.identify import Identification, KnownInertia, identify
from ident.estimate.result_file import write_parameters
from ident.records.record import Record
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

PAPER_PROTOTYPE = "prototype"
"""Name of the vehicle that Table 2 of the paper describes."""


@dataclass(frozen=True)
class Order:
    """A campaign as it is asked for.

    Attributes:
        out: run folder.
        vehicle: shipped vehicle file by name, or a path.
        network: network file, None for the vehicle's own.
        steps, periods, seed: what to drive.
        known_inertia: B_w where it is given.
        log_format: of the logs.
        bus: what it is driven on, for people.
        prototype: emulated prototype, empty on a real vehicle.
        payload: mass of the load of the loaded steps [kg].
    """

    out: Path
    vehicle: str
    network: Path | None
    steps: tuple[str, ...]
    periods: int
    seed: int
    known_inertia: KnownInertia | None
    log_format: LogFormat
    bus: str
    prototype: str
    payload: float = 0.0


@dataclass(frozen=True)
class HumanOperator:
    """Asks the person beside the vehicle to lift and lower it."""

    console: Console

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
        self.console.input(f"[bold]{what}[/bold], then press Enter. ")


def plan_run(order: Order, console: Console) -> Run:
    """Optimise the excitation; nothing is written yet.

    Raises:
        UserError: a file is wrong, the folder is in use, or the floor is too small.
    """
    refuse_used(RunFolder(order.out))
    vehicle = load_vehicle(order.vehicle)
    network = load_network(order.network or network_file_of(order.vehicle))
    with progress(console) as bars:
        excitations = sum(step in DIAGNOSTIC and DIAGNOSTIC[step].optimised for step in order.steps)
        task = bars.add_task("optimising the excitation", total=excitations)
        plan = make_plan(
            vehicle,
            np.random.default_rng(order.seed),
            steps=order.steps,
            periods=order.periods,
            cycle=network.cycle_period,
            progress=lambda _: bars.advance(task),
        )
    return Run(
        RunFolder(order.out),
        plan,
        network,
        order.seed,
        order.bus,
        order.prototype,
        order.known_inertia,
        order.payload,
    )


def refuse_changed(run: Run, order: Order, given: Collection[str]) -> None:
    """Refuse options of a resumed campaign that differ from what was planned.

    Args:
        run: as it was planned.
        order: as it is asked for now.
        given: names of the options that were given.

    Raises:
        CampaignError: an option that was given differs; named.
    """
    changed: Mapping[str, Callable[[], bool]] = {
        "vehicle": lambda: _differ(find_data_file("ident.vehicle", order.vehicle), run.folder.vehicle),
        "network": lambda: _differ(order.network or network_file_of(order.vehicle), run.folder.network),
        "skip": lambda: order.steps != run.plan.steps,
        "lateral": lambda: order.steps != run.plan.steps,
        "diagnostic": lambda: order.steps != run.plan.steps,
        "payload": lambda: order.payload != run.payload,
        "b_w": lambda: order.known_inertia != run.known_inertia,
        "b_w_std": lambda: order.known_inertia != run.known_inertia,
        "periods": lambda: order.periods != run.plan.periods,
        "seed": lambda: order.seed != run.seed,
    }
    different = [name for name, differs in changed.items() if name in given and differs()]
    if different:
        options = ", ".join(f"--{name.replace('_', '-')}" for name in different)
        raise CampaignError(
            f"{run.folder.path} was planned with another {options}.",
            "A run goes on as it was planned: leave that out, or start another run (--out).",
        )


def _differ(one: Path, other: Path) -> bool:
    return one.read_bytes() != other.read_bytes()


def drive_run(
    run: Run,
    order: Order,
    bus: can.BusABC,
    clock: Clock,
    operator: Operator,
    console: Console,
    may_move: Callable[[], bool],
) -> bool:
    """Check the network, ask, and only then make the run folder and move; gives whether it was driven.

    Raises:
        UserError: the network is not the one described, or a step failed; the drives are stopped.
    """
    console.print(loop_table(run.plan), room_table(run.plan))
    console.print("Resetting the six nodes and asking who they are; nothing moves.")
    with console.status("looking for the six nodes"):
        check_network(bus, clock, run.network)
    console.print("All six nodes answer: identity, mode and units are those of the network file.")
    if not may_move():
        return False
    if not run.folder.manifest.is_file():
        create_run(run, find_data_file("ident.vehicle", order.vehicle))
    recorder = Recorder(run.folder.frames, order.log_format)
    try:
        with progress(console) as bars:
            runner = CampaignRunner(run, bus, clock, recorder, operator, _bar_per_step(bars))
            runner.drive()
    finally:
        recorder.close()
    if runner.overruns:
        console.print(f"[yellow]{runner.overruns} cycles began late: close other programs on this computer.[/yellow]")
    return True


def identify_run(
    folder: Path, out: Path, known_inertia: KnownInertia | None, truth: Parameters | None, console: Console
) -> None:
    """Identify a run from its frames; tables, `parameters.toml` and report.

    Raises:
        UserError: the folder, a log, or the excitation in it will not do.
    """
    run = open_run(folder)
    inertia = known_inertia or run.known_inertia
    with console.status("decoding the frames"):
        record = read_run(folder)
    _identify(record, run.plan.vehicle, inertia, out, provenance_of(run), truth, run.plan, console)


def identify_records(
    paths: Sequence[Path],
    vehicle: str,
    network: Path | None,
    known_inertia: KnownInertia | None,
    out: Path,
    console: Console,
) -> None:
    """Identify from logs or plain records; tables, `parameters.toml` and report.

    Raises:
        UserError: a file, or the excitation in it, will not do.
    """
    described = load_vehicle(vehicle)
    loaded = load_network(network or network_file_of(vehicle))
    with console.status("reading"):
        record = join([read_any(path, loaded) for path in paths])
    provenance = {"run": record.source, "vehicle": described.name, "quasiomni": version("quasiomni")}
    _identify(record, described, known_inertia, out, provenance, None, None, console)


def report_run(folder: Path, target: Path, truth: Parameters | None, console: Console) -> None:
    """Write the report of a run from its frames.

    Raises:
        UserError: the folder, a log, or the excitation in it will not do.
    """
    run = open_run(folder)
    vehicle = run.plan.vehicle
    with console.status("identifying"):
        record = read_run(folder)
        result = identify(record, vehicle.geometry, known_inertia=run.known_inertia)
    write_report(_content(record, result, vehicle, provenance_of(run), truth, run.plan), target)
    console.print(f"Written: {target}")


def provenance_of(run: Run) -> dict[str, str]:
    """Where a result comes from, for its files."""
    return {
        "run": run.folder.path.name,
        "vehicle": run.plan.vehicle.name,
        "bus": run.bus,
        "seed": str(run.seed),
        "quasiomni": version("quasiomni"),
    }


def _identify(
    record: Record,
    vehicle: VehicleDescription,
    inertia: KnownInertia | None,
    out: Path,
    provenance: Mapping[str, str],
    truth: Parameters | None,
    plan: Plan | None,
    console: Console,
) -> None:
    with console.status("identifying"):
        result = identify(record, vehicle.geometry, known_inertia=inertia)
    content = _content(record, result, vehicle, provenance, truth, plan)
    console.print(parameter_table(result, truth), excitation_table(result), step_table(result))
    if content.paper:
        console.print(paper_table(result))
    console.print(condition_line(result))
    for note in record.notes:
        console.print(f"[yellow]{note}[/yellow]")
    _write_result(result, out, provenance)
    with console.status("writing the report"):
        write_report(content, out / "report.html")
    console.print(f"Written: {out / 'parameters.toml'}, {out / 'report.html'}")


def _content(
    record: Record,
    result: Identification,
    vehicle: VehicleDescription,
    provenance: Mapping[str, str],
    truth: Parameters | None,
    plan: Plan | None,
) -> ReportContent:
    """What a report shows; Table 2 of the paper only beside the vehicle that it describes."""
    title, paper = f"Identification of {vehicle.name}", vehicle.name == PAPER_PROTOTYPE
    return ReportContent(title, result, record, vehicle, truth, plan, provenance, record.notes, paper)


def _write_result(result: Identification, out: Path, provenance: Mapping[str, str]) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
        write_parameters(result, out / "parameters.toml", provenance)
    except OSError as error:
        raise UserError(f"{out} cannot be written to: {error.strerror}.", "Name another folder (--out).") from error


@contextmanager
def progress(console: Console) -> Iterator[Progress]:
    """Progress bars for long work."""
    columns = (SpinnerColumn(), TextColumn("{task.description:<26}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console) as bars:
        yield bars


def _bar_per_step(bars: Progress) -> Callable[[str, int, int], None]:
    tasks: dict[str, TaskID] = {}

    def show(step: str, done: int, total: int) -> None:
        if step not in tasks:
            tasks[step] = bars.add_task(step, total=total)
        bars.update(tasks[step], completed=done, total=total)

    return show

"""Scenarios of the emulator: what `emulate --scenario` takes, runs and prints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from ident.errors import UserError
from ident.extras import EngineName
from ident.writing import refuse_folder, refuse_inputs
from quasiomni.application import console
from quasiomni.options import load_emulation
from quasiomni.showing import say

if TYPE_CHECKING:
    from emulator.vehicle import EmulatedVehicle
    from hil.bench.serving import VehicleServer
    from hil.bench.simulators import Simulator
    from hil.faults import Fault
    from hil.network import Network
    from hil.scenario.running import ScenarioReport
    from hil.scenario.scenario import Scenario
    from hil.scenario.serving import ServedScenario, ServedWorld
    from ident.effects import Effect


class Stand(StrEnum):
    """Where an emulated vehicle stands when it comes up."""

    FLOOR = "floor"
    JACK = "jack"


ScenarioOption = Annotated[
    Path | None,
    typer.Option(
        help="TOML file of timed set-points, faults and expectations. With set-points it drives by itself, in "
        "simulated time, and no bus is served. Exit code 1 where an expectation fails."
    ),
]
JunitOption = Annotated[Path | None, typer.Option(help="With --scenario: write JUnit XML here.")]
JsonOption = Annotated[Path | None, typer.Option(help="With --scenario: write times and values here.")]

_OF_A_BUS: Final[Sequence[str]] = ("bus", "lockstep", "control", "storage", "duration")
"""Options that say how a bus is served, which a scenario with set-points needs none for."""
_NOT_WATCHED: Final[Sequence[str]] = ("plant", "video")
"""Options whose vehicle shows no ground truth."""


def open_scenario(
    context: typer.Context, path: Path | None, files: tuple[Path | None, Path | None]
) -> ScenarioRun | None:
    """The scenario that was asked for.

    Raises:
        UserError: it cannot be read, or other options contradict it.
    """
    if path is None:
        if any(files):
            raise UserError("--junit and --json are of a scenario.", "Add --scenario FILE, or leave them out.")
        return None
    for file in files:
        if file is not None:
            refuse_folder(file)
    refuse_inputs(files, [path])
    given = _given(context)
    if wrong := [name for name in _NOT_WATCHED if name in given]:
        raise UserError(f"--{wrong[0]} cannot be watched by a scenario.", f"Leave --{wrong[0]} or --scenario out.")
    load_emulation()
    from hil.scenario.reader import read_scenario  # needs the emulator

    scenario = read_scenario(path)
    if scenario.drives and (wrong := [name for name in _OF_A_BUS if name in given]):
        raise UserError(
            f"{path} has set-points, so it drives by itself and serves no bus: --{wrong[0]} does nothing.",
            f"Leave --{wrong[0]} out; or leave [[setpoint]] out of the file, and let your own master drive.",
        )
    return ScenarioRun(scenario, given, *files)


def _given(context: typer.Context) -> frozenset[str]:
    sources = {name: context.get_parameter_source(name) for name in context.params}
    return frozenset(name for name, source in sources.items() if source is not None and source.name == "COMMANDLINE")


@dataclass(frozen=True)
class ScenarioRun:
    """A scenario, what the command line says beside it, and the files to write.

    Attributes:
        scenario: as read.
        given: names of the options on the command line; they win over the file.
        junit, json: files to write, or None.
    """

    scenario: Scenario
    given: frozenset[str]
    junit: Path | None
    json: Path | None

    @property
    def drives_itself(self) -> bool:
        """It has set-points."""
        return self.scenario.drives

    def bench(self, prototype: str, network: Path | None, seed: int) -> tuple[str, Path | None, int]:
        """Prototype, network file and seed: of the command line where it names them, else of the file."""
        from hil.scenario.bench import chosen_by

        choice = chosen_by(self.scenario)
        return (
            prototype if "prototype" in self.given else choice.prototype,
            network or (None if "prototype" in self.given else choice.network),
            seed if "seed" in self.given else choice.seed,
        )

    def stand(self, stand: Stand) -> Stand:
        """Where the vehicle stands."""
        return Stand.JACK if self.scenario.lifted and "stand" not in self.given else stand

    def drive(
        self,
        prototype: str,
        network: Path | None,
        seed: int,
        engine: EngineName | None,
        effects: Sequence[Effect],
        simulator: Simulator | None,
        faults: Sequence[Fault],
        *,
        delays: bool,
        gui: bool,
    ) -> None:
        """Run it by itself, print what came of it, and exit by that.

        Raises:
            UserError: a file cannot be used, or something in the scenario is not there.
        """
        from hil.scenario.bench import BenchChoice, run_alone

        choice = BenchChoice(prototype, network, seed, engine, effects, simulator, delays, faults, gui)
        with console.status(f"running {self.scenario.name}"):
            report, _ = run_alone(self.scenario, choice)
        self.end(report)

    def watch(self, vehicle: EmulatedVehicle, network: Network) -> WatchedServer:
        """What watches a server."""
        from hil.scenario.serving import ServedScenario, ServedWorld

        world = ServedWorld(vehicle, network)
        return WatchedServer(world, ServedScenario(self.scenario, world))

    def end(self, report: ScenarioReport) -> None:
        """Print what came of it, write the files, and exit with code 1 where an expectation has failed."""
        from hil.scenario import report as reports

        say(reports.lines(report))
        if self.junit is not None:
            reports.write_junit(report, self.junit)
        if self.json is not None:
            reports.write_json(report, self.json)
        if not report.passed:
            raise typer.Exit(1)


@dataclass(frozen=True)
class WatchedServer:
    """A server, and the scenario that runs beside it."""

    world: ServedWorld
    scenario: ServedScenario

    def hear(self, can_id: int, data: bytes) -> None:
        """A frame passes."""
        self.world.hear(can_id, data)

    def served_by(self, server: VehicleServer) -> None:
        """From now on there is something to see."""
        self.world.server = server

    def over(self) -> bool:
        """Look; whether the scenario has ended."""
        return self.scenario.over()

    def report(self) -> ScenarioReport:
        """What came of it."""
        return self.scenario.report()

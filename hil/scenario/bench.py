"""The bench that a scenario is run on, as far as its file says, and a master of the scenario's own on it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from emulator.engine.choice import ENGINES
from emulator.vehicle import EmulatedVehicle
from hil.bench.lockstep import LockstepBench
from hil.bench.simulators import Simulator, load_simulated, naming
from hil.faults import Fault
from hil.network import network_file_of
from hil.pytest_plugin.world import World
from hil.scenario.running import ScenarioReport, run_scenario
from hil.scenario.scenario import Scenario
from ident.effects import Effect
from ident.errors import DataFileError
from ident.extras import EngineName, default_engine


@dataclass(frozen=True)
class BenchChoice:
    """What a bench is built of.

    Attributes:
        prototype: by name or path.
        network: network file; None: the prototype's.
        seed: of all noise.
        engine: None for the default one.
        effects, simulator: of the emulated vehicle.
        delays: frames wait for arbitration and take their bit times.
        faults: beside those of the scenario, counted from its beginning.
        gui: with a window.
    """

    prototype: str = "prototype"
    network: Path | None = None
    seed: int = 1
    engine: EngineName | None = None
    effects: Sequence[Effect] = ()
    simulator: Simulator | None = None
    delays: bool = False
    faults: Sequence[Fault] = ()
    gui: bool = False


def chosen_by(scenario: Scenario) -> BenchChoice:
    """What the file says; the paths in it are those from its own folder."""
    settings = scenario.settings
    prototype, network = settings.get("prototype", "prototype"), settings.get("network")
    return BenchChoice(
        _beside(scenario, str(prototype)) if Path(str(prototype)).suffix else str(prototype),
        None if network is None else Path(_beside(scenario, str(network))),
        int(settings.get("seed", 1)),
    )


def run_alone(scenario: Scenario, choice: BenchChoice) -> tuple[ScenarioReport, World]:
    """Run a scenario with set-points on a bench of its own, in simulated time.

    Raises:
        UserError: nobody drives, a file cannot be used, or something in the scenario is not there.
    """
    if not scenario.drives:
        raise DataFileError(
            f"{scenario.path} has no [[setpoint]], so nobody drives.",
            "Add some, or run it beside a master of yours: quasiomni emulate --bus ... --scenario FILE.",
        )
    network = choice.network or network_file_of(choice.prototype)
    emulated = load_simulated(choice.prototype, network, choice.simulator)
    effects = choice.effects if choice.simulator is None else choice.simulator.with_more(choice.effects)
    with naming(choice.simulator):
        vehicle = EmulatedVehicle(
            emulated.prototype,
            seed=choice.seed,
            gui=choice.gui,
            make_engine=ENGINES[choice.engine or default_engine()],
            effects=effects,
        )
    with (
        vehicle,
        LockstepBench(vehicle, network, ground=vehicle, seed=choice.seed, delays=choice.delays) as bench,
    ):
        world = World(bench, vehicle, emulated.network)
        return run_scenario(scenario, world, choice.faults), world


def _beside(scenario: Scenario, name: str) -> str:
    return str(scenario.path.parent / name)

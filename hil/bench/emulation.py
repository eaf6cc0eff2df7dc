"""The emulated side as the command line composes it: bench in this process, or server for other processes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import can

from emulator.engine.choice import ENGINES
from emulator.firmware.hardware import VehicleHardware
from emulator.firmware.storage import FolderMemory
from emulator.vehicle import EmulatedVehicle
from hil.bench.lockstep import LockstepBench
from hil.bench.serving import VehicleServer
from hil.bench.simulators import Simulator, load_simulated, naming
from hil.bench.tracing import TracedServer
from hil.bus.clock import Clock
from hil.bus.opening import open_served_bus
from hil.bus.stamps import Stamps
from hil.bus.traffic import Hear
from hil.cosimulation.plant import FmuVehicle
from hil.faults import Fault, parse_fault, parse_script
from hil.faults.devices import Slippery
from hil.faults.fault import FaultError
from hil.network import Network
from ident.errors import UserError
from ident.extras import EngineName, default_engine
from ident.reading import read_bounded

if TYPE_CHECKING:
    from hil.video.film import Video
    from ident.effects import Effect


class Plant(VehicleHardware, Slippery, Protocol):
    """What the nodes can sit on, and what hands do with it."""

    def lift(self) -> None:
        """Put the vehicle on the jack-stand."""

    def lower(self) -> None:
        """Take it off."""

    def load(self, mass: float) -> None:
        """Put a load [kg] on it, over its centre, instead of any load before."""


@dataclass(frozen=True)
class BenchOperator:
    """Lifts and lowers the emulated vehicle."""

    vehicle: Plant

    def lift(self) -> None:
        """On the jack-stand."""
        self.vehicle.lift()

    def lower(self) -> None:
        """On the floor."""
        self.vehicle.lower()

    def load(self, mass: float) -> None:
        """A load over the centre [kg]."""
        self.vehicle.load(mass)

    def unload(self) -> None:
        """Without it."""
        self.vehicle.load(0.0)


@dataclass(frozen=True)
class Bench:
    """What a campaign needs of the emulated side: bus, clock and hands."""

    bus: can.BusABC
    clock: Clock
    operator: BenchOperator


def assumed(prototype: str, network: Path, simulator: Simulator | None = None) -> tuple[str, ...]:
    """What no file says of an emulated vehicle, a line each; none for one with a prototype file.

    Raises:
        DataFileError: a file is missing or malformed, or two places disagree.
    """
    return load_simulated(prototype, network, simulator).assumed


def complete_network(prototype: str, network: Path, simulator: Simulator | None = None) -> Network:
    """The network of an emulated vehicle, with what its vehicle file owns.

    Raises:
        DataFileError: a file is missing or malformed, or two places disagree.
    """
    return load_simulated(prototype, network, simulator).network


@contextmanager
def vehicle(
    prototype: str,
    seed: int,
    gui: bool,
    network: Path,
    effects: Sequence[Effect] = (),
    fmu: Path | None = None,
    engine: EngineName | None = None,
    video: Video | None = None,
    simulator: Simulator | None = None,
) -> Iterator[Plant]:
    """The emulated prototype with effects, or an FMU with the prototype's drives and encoders; closed at the end.

    Args:
        prototype: shipped prototype by name, or a path.
        seed: of all noise.
        gui: with a window.
        network: network file.
        effects: that it has; beside those of `simulator`, to which they add up.
        fmu: in place of the physics engine.
        engine: None for the default one.
        video: to be written at the end.
        simulator: model whose parameters and effects it has in place of the prototype's; None: the prototype's own.

    Raises:
        UserError: prototype and network file disagree, an effect, a window or a video is asked of an FMU, it cannot be
            run, no vehicle can be as the simulator says, or there is nothing to draw the video with.
    """
    built = load_simulated(prototype, network, simulator).prototype
    if fmu is None:
        chosen = engine or default_engine()
        if gui and video and chosen is EngineName.MUJOCO:
            # Two kinds of OpenGL in one process end it.
            raise UserError("MuJoCo shows a window or draws a video, not both.", "Leave out --gui or --video.")
        wanted = effects if simulator is None else simulator.with_more(effects)
        with naming(simulator):
            emulated = EmulatedVehicle(built, seed=seed, gui=gui, make_engine=ENGINES[chosen], effects=wanted)
        with emulated, _perhaps_filmed(emulated, chosen, video) as seen:
            yield seen
        return
    if effects or gui or video:
        raise UserError(
            "An FMU takes no --effect, and has no window and no video.",
            "Tune the effect's parameters in the FMU itself.",
        )
    with FmuVehicle(fmu, built, seed=seed) as plant:
        yield plant


def _leave_alone(_vehicle: Plant, _bench: LockstepBench) -> None:
    """Nobody watches."""


@contextmanager
def bench(
    prototype: str,
    seed: int,
    gui: bool,
    network: Path,
    effects: Sequence[Effect] = (),
    fmu: Path | None = None,
    engine: EngineName | None = None,
    video: Video | None = None,
    simulator: Simulator | None = None,
    begin: Callable[[Plant, LockstepBench], object] = _leave_alone,
) -> Iterator[Bench]:
    """What `vehicle` gives, behind an in-process bus in lockstep; `begin` is called with both before anything moves."""
    with (
        vehicle(prototype, seed, gui, network, effects, fmu, engine, video, simulator) as emulated,
        LockstepBench(emulated, network, ground=emulated, seed=seed) as lockstep,
    ):
        begin(emulated, lockstep)
        yield Bench(lockstep.bus, lockstep.clock, BenchOperator(emulated))


@contextmanager
def _perhaps_filmed(emulated: EmulatedVehicle, engine: EngineName, video: Video | None) -> Iterator[Plant]:
    if video is None:
        yield emulated
        return
    from hil.video.developing import filmed  # needs libraries that only a video needs

    with filmed(emulated, engine, video) as film:
        yield film


@contextmanager
def server_bus(name: str, network: Network) -> Iterator[can.BusABC]:
    """The bus that an emulator serves: the hub of a `unix:` bus, a member of any other.

    Raises:
        BusError: the bus cannot be opened.
    """
    bus = open_served_bus(name, network.bit_rate)
    try:
        yield bus
    finally:
        bus.shutdown()


def server(
    emulated: Plant,
    bus: can.BusABC,
    clock: Clock,
    network: Path,
    lockstep: bool,
    *,
    seed: int = 0,
    delays: bool = False,
    storage: Path | None = None,
    hear: Hear | None = None,
    stamps: Stamps | None = None,
) -> VehicleServer:
    """A server of an emulated vehicle on a bus; `seed` is that of its faults, see `VehicleServer`.

    Args:
        storage: folder where the nodes store parameters.
        hear: called with every frame as it passes.
        stamps: where its turns are stamped.

    Raises:
        OSError: the folder cannot be made.
    """
    if storage is not None:
        # Now, and not when a master stores for the first time, it shows whether that is possible.
        storage.mkdir(parents=True, exist_ok=True)
    memory = None if storage is None else FolderMemory(storage)
    words = emulated, bus, clock, network, lockstep, emulated, seed, delays, memory, hear
    return VehicleServer(*words) if stamps is None else TracedServer(stamps, *words)


def read_faults(texts: Sequence[str]) -> list[Fault]:
    """Faults as they are given on the command line: each one line, or the path of a script.

    Raises:
        FaultError: one cannot be read.
    """
    faults: list[Fault] = []
    for text in texts:
        path = Path(text)
        if path.is_file():
            faults += parse_script(read_bounded(path).decode(errors="replace"))
        elif path.suffix and not {"@", ":"} & set(text):
            raise FaultError(f"{text} does not exist.", "Name a file with one fault a line, or write KIND@PLACE.")
        else:
            faults.append(parse_fault(text))
    return faults

"""What a replay is asked for, the emulations that it takes, and its answer."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from emulator.engine.choice import ENGINES
from emulator.prototype import Prototype
from emulator.vehicle import EmulatedVehicle
from hil.bench.emulation import BenchOperator
from hil.bench.lockstep import LockstepBench
from hil.bench.simulators import Simulator, load_simulated, naming, read_simulator
from hil.campaign.folder import Run, RunFolder, open_run
from hil.campaign.runner import check_network
from hil.network import Network, network_file_of
from hil.replay.commissioning import boots, commission, first_sample
from hil.replay.comparing import Compared, compare
from hil.replay.hands import Hands, is_lifted
from hil.replay.playing import Mark, Played, Player, Told
from hil.replay.recording import Recording, read_logs, read_run_folder
from ident.effects import Effect
from ident.errors import UserError
from ident.extras import EngineName, default_engine
from ident.writing import refuse_folder, refuse_inputs

EMULATIONS: Final = 3
"""Emulations of a log whose noise nobody knows: what they differ by is what a record may differ by."""


@dataclass(frozen=True)
class ReplayOrder:
    """What is asked for.

    Attributes:
        logs: logs in the order in which they were recorded, or one run folder.
        vehicle: prototype or vehicle file; None: that of the run, else the prototype.
        network: network file; None: the run's, else the vehicle's.
        engine: of the physics; None: the run's, else the default.
        effects: that the emulated vehicle has.
        simulator: model that it is made from; None: the run's, if it has one.
        seed: of its noise; None: the run's, else 1.
        lifted: on the jack-stand; None: as the names of the logs say.
        emulations: how many; None: one where the noise is that of the record, else three.
        json, report: files to write, or None.
        force: take a model that was assessed as unusable.
    """

    logs: Sequence[Path]
    vehicle: str | None = None
    network: Path | None = None
    engine: EngineName | None = None
    effects: Sequence[Effect] = ()
    simulator: Path | None = None
    seed: int | None = None
    lifted: bool | None = None
    emulations: int | None = None
    json: Path | None = None
    report: Path | None = None
    force: bool = False

    @property
    def files(self) -> tuple[Path, ...]:
        """What is to be written."""
        return tuple(path for path in (self.json, self.report) if path is not None)


@dataclass(frozen=True)
class ReplayAnswer:
    """What came of a replay.

    Attributes:
        source: what was replayed.
        vehicle: what answered, in words.
        compared: where both differ.
        marks: of the logs on the axis of the replay.
        logs: how many there are.
        emulations: how many the tolerances are from; 1: none are.
        in_step: the log is of a master in lockstep with an emulator, so that time passed as it did then.
        others: frames that were played.
        notes: what a reader should know.
    """

    source: str
    vehicle: str
    compared: Compared
    marks: tuple[Mark, ...]
    logs: int
    emulations: int
    in_step: bool
    others: int
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Scene:
    """Everything that all emulations of a replay have in common."""

    recording: Recording
    run: Run | None
    name: str
    prototype: Prototype
    network: Network
    engine: EngineName | None
    simulator: Simulator | None
    effects: Sequence[Effect]
    lifted: bool
    in_step: bool
    notes: list[str] = field(default_factory=list)


Begin = Callable[[EmulatedVehicle, LockstepBench, Network], object]
"""Called with vehicle, bench and complete network of the emulation that is compared, before anything moves."""


def _leave_alone(_vehicle: EmulatedVehicle, _bench: LockstepBench, _network: Network) -> None:
    """Nobody watches."""


def replay(order: ReplayOrder, told: Told, begin: Begin = _leave_alone) -> ReplayAnswer:
    """Play a record into the bench, and compare; nothing is written.

    Args:
        order: what is asked for.
        told: is told the progress.
        begin: lets somebody watch.

    Raises:
        UserError: a log cannot be read or replayed, or no vehicle can be as it is asked for.
    """
    _refuse_unworkable(order)
    scene = _scene(order)
    seed = order.seed if order.seed is not None else (scene.run.seed if scene.run is not None else 1)
    count = order.emulations or (1 if scene.in_step else EMULATIONS)
    # The others only tell by how much noise alone makes emulations differ.
    played = [_emulated(scene, seed + number, told, _leave_alone if number else begin) for number in range(count)]
    compared = compare(played[0], played[1:], scene.network)
    if not compared.answers:
        raise UserError(
            f"{scene.recording.source} holds no answer of a node of {scene.network.path}.",
            "Name the network file that it was recorded with (--network).",
        )
    return ReplayAnswer(
        scene.recording.source,
        _described(scene, seed),
        compared,
        tuple(played[0].marks),
        len(scene.recording.parts),
        count,
        scene.in_step,
        played[0].others,
        tuple(scene.notes),
    )


def _refuse_unworkable(order: ReplayOrder) -> None:
    for path in order.files:
        refuse_folder(path)
    folders = [path for path in order.logs if path.is_dir()]
    if folders and len(order.logs) > 1:
        raise UserError(f"{folders[0]} is a folder, and not all that is named.", "Name one run folder, or logs.")
    sources = RunFolder(folders[0]).sources if folders else order.logs
    refuse_inputs(order.files, [*sources, order.simulator, order.network])


def _scene(order: ReplayOrder) -> _Scene:
    run = open_run(order.logs[0]) if order.logs[0].is_dir() else None
    recording = read_logs(order.logs) if run is None else read_run_folder(run.folder.frames, str(order.logs[0]))
    name = order.vehicle or (run.rehearsed if run is not None else "prototype")
    network_file = order.network or (run.network.path if run is not None else network_file_of(name))
    path = order.simulator or (run.simulator if run is not None else None)
    simulator = None if path is None else read_simulator(path, force=order.force)
    emulated = load_simulated(name, network_file, simulator)
    return _Scene(
        recording,
        run,
        name,
        emulated.prototype,
        emulated.network,
        order.engine or (run.engine if run is not None else None),
        simulator,
        order.effects,
        is_lifted([part.name for part in recording.parts]) if order.lifted is None else order.lifted,
        run is not None and bool(run.prototype),
    )


def _described(scene: _Scene, seed: int) -> str:
    parts = [scene.name if scene.simulator is None else f"{scene.name} as {scene.simulator.path}"]
    parts += [str(effect) for effect in scene.effects]
    return f"{', '.join(parts)}, seed {seed}"


def _emulated(scene: _Scene, seed: int, told: Told, begin: Begin) -> Played:
    with _bench(scene, seed) as (bench, hands, vehicle):
        begin(vehicle, bench, scene.network)
        played = _played(scene, Player(bench, scene.network, told), bench, hands, vehicle)
        if bench.faults.log:
            injected = ", ".join(str(one.fault) for one in bench.faults.log)
            scene.notes.append(f"Faults were injected meanwhile, and what differs may be their work: {injected}.")
        return played


def _played(
    scene: _Scene, player: Player, bench: LockstepBench, hands: Hands | None, vehicle: EmulatedVehicle
) -> Played:
    if scene.in_step:
        # A campaign asks who is there before it begins to record.
        check_network(bench.bus, bench.clock, scene.network)
        return player.in_step(scene.recording, hands.before if hands is not None else _nobody)
    if boots(scene.recording):
        if hands is None and scene.lifted:
            vehicle.lift()
        return player.by_stamps(scene.recording, hands.before if hands is not None else _nobody)
    _stand(scene, vehicle)
    enable = first_sample(scene.recording, scene.network).enabled
    commission(bench, scene.network, scene.recording, enable=enable)
    return player.by_stamps(scene.recording, _nobody)


def _nobody(_part: str, _can_id: int, _data: bytes) -> None:
    """No hands do anything."""


@contextmanager
def _bench(scene: _Scene, seed: int) -> Iterator[tuple[LockstepBench, Hands | None, EmulatedVehicle]]:
    effects = scene.effects if scene.simulator is None else scene.simulator.with_more(scene.effects)
    with naming(scene.simulator):
        vehicle = EmulatedVehicle(
            scene.prototype, seed=seed, make_engine=ENGINES[scene.engine or default_engine()], effects=effects
        )
    with vehicle, LockstepBench(vehicle, scene.network.path, ground=vehicle) as bench:
        run, operator = scene.run, BenchOperator(vehicle)
        yield bench, None if run is None else Hands(scene.recording, operator, run.payload), vehicle


def _stand(scene: _Scene, vehicle: EmulatedVehicle) -> None:
    first = first_sample(scene.recording, scene.network)
    vehicle.stand_as(first.steering, first.wheels, lifted=scene.lifted)
    note = "The log begins in motion; the emulated vehicle begins at rest."
    if first.moving and note not in scene.notes:
        scene.notes.append(note)

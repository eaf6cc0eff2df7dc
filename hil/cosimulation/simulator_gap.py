"""How much nearer an emulated vehicle comes to a record by the effects that were diagnosed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from hil.bench.simulators import Simulator, load_simulated, naming, read_simulator
from hil.campaign.folder import RunFolder, open_run, sources_of
from hil.campaign.reading import read_as
from hil.cosimulation.emulated import forces_of
from hil.network import network_file_of
from hil.network.described import Described
from ident.diagnosis.vehicle.records.following import Difference, Following, all_differences, followings_of
from ident.diagnosis.vehicle.simulator_gap import simulator_gap
from ident.effects.extended import ExtendedModel
from ident.errors import RecordError
from ident.estimate.filters import Processing
from ident.extras import EngineName
from ident.records.record import Record
from ident.report.simulator_gap import (
    SimulatorReport,
    summary_lines,
    write_simulator_json,
    write_simulator_report,
)
from ident.stages import Stage, untold
from ident.vehicle.description import find_data_file
from ident.writing import refuse_folder, refuse_inputs

__all__ = ["SimulatorOrder", "judge_simulator", "summary_lines", "write_simulator_gap"]


@dataclass(frozen=True)
class SimulatorOrder:
    """What is asked for.

    Attributes:
        record: run folder, log or record whose torques are simulated.
        simulator: `parameters.toml` of the simulator as it is now.
        before: of the simulator as it was; None: that of the run, without effects; else the vehicle file's guesses.
        vehicle: prototype or vehicle file; None: that of the run.
        network: network file; None: the vehicle's.
        engine: of the physics.
        json, report: files to write, or None.
        force: take a model that was assessed as unusable.
    """

    record: Path
    simulator: Path
    before: Path | None
    vehicle: str | None
    network: Path | None
    engine: EngineName
    json: Path | None = None
    report: Path | None = None
    force: bool = False

    @property
    def files(self) -> tuple[Path, ...]:
        """What is to be written."""
        return tuple(path for path in (self.json, self.report) if path is not None)


@dataclass(frozen=True)
class _Scene:
    """What both simulators have in common.

    Attributes:
        record: what was driven.
        described: the vehicle that it is of.
        prototype: of the emulator, by name or file.
    """

    record: Record
    described: Described
    prototype: str


def judge_simulator(order: SimulatorOrder, stage: Stage = untold) -> SimulatorReport:
    """Simulate before and after; nothing is written yet.

    Raises:
        UserError: a file cannot be used or written, or no vehicle can be as a model says.
    """
    _refuse_unworkable(order)
    after = read_simulator(order.simulator, force=order.force)
    stage("reading the record")
    scene = _scene(order)
    before = _before(order, scene)
    processing = Processing()
    followings = followings_of(
        scene.record, scene.described.vehicle.geometry, scene.described.vehicle.prior, processing
    )
    off = []
    for name, simulator in (("before", before), ("after", after)):
        told = partial(_told, stage, name)
        off.append(_differences(simulator, scene, followings, order.engine, processing, told))
    gap = simulator_gap(*off)
    effects = tuple(str(effect) for effect in after.model.effects)
    return SimulatorReport(gap, str(order.record), str(before.path), str(after.path), effects, str(order.engine))


def write_simulator_gap(order: SimulatorOrder, answer: SimulatorReport) -> list[Path]:
    """Write the files that were asked for, each whole; gives their paths.

    Raises:
        UserError: one cannot be written.
    """
    if order.json is not None:
        write_simulator_json(answer, order.json)
    if order.report is not None:
        write_simulator_report(answer, order.report)
    return list(order.files)


def _refuse_unworkable(order: SimulatorOrder) -> None:
    for path in order.files:
        refuse_folder(path)
    vehicle = None if order.vehicle is None else find_data_file("ident.vehicle", order.vehicle)
    refuse_inputs(order.files, [*sources_of(order.record), order.simulator, order.before, vehicle, order.network])


def _scene(order: SimulatorOrder) -> _Scene:
    record, described = read_as(order.record, order.vehicle, order.network)
    if order.vehicle is not None or not RunFolder(order.record).manifest.is_file():
        return _Scene(record, described, order.vehicle or "prototype")
    return _Scene(record, described, open_run(order.record).rehearsed)


def _before(order: SimulatorOrder, scene: _Scene) -> Simulator:
    if order.before is not None:
        return read_simulator(order.before, force=order.force)
    identified = RunFolder(order.record).parameters
    if identified.is_file():
        # Without the effects it is what it is, however it was assessed.
        plain = read_simulator(identified, force=True)
        return replace(plain, model=ExtendedModel(plain.model.parameters))
    vehicle = scene.described.vehicle
    guessed = vehicle.path or find_data_file("ident.vehicle", scene.prototype)
    return Simulator(guessed, ExtendedModel(vehicle.prior))


def _told(stage: Stage, name: str, step: str) -> None:
    stage(f"{name}, {step}")


def _differences(
    simulator: Simulator,
    scene: _Scene,
    followings: Sequence[Following],
    engine: EngineName,
    processing: Processing,
    stage: Stage,
) -> list[Difference]:
    network = scene.described.network.path or network_file_of(scene.prototype)
    prototype = load_simulated(scene.prototype, network, simulator).prototype
    if prototype.geometry != scene.described.vehicle.geometry:
        raise RecordError(
            f"{scene.record.source} is of another vehicle than {scene.prototype}.", "Say which one it is (--vehicle)."
        )
    with naming(simulator):
        forces = forces_of(prototype, simulator.model.effects, engine, followings, stage)
    return all_differences(followings, forces, processing)

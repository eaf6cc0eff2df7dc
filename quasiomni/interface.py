"""What a program may use of quasiomni: a dozen names, each for one thing that the commands do.

    import quasiomni as qo

    vehicle = qo.load_vehicle("prototype")
    record = qo.read_record("runs/demo")
    result = qo.identify(record, vehicle)
    print(result["m_ch"].value, result["m_ch"].ci95)

Everything is in SI units, and raises a `quasiomni.UserError` with a remedy where the input will not do.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hil.campaign.folder import RunFolder
from hil.campaign.reading import read_run
from hil.network import network_file_of
from ident.assessment import Assessment
from ident.assessment import assess as assess_result
from ident.diagnosis.vehicle.closing import extended_model
from ident.diagnosis.vehicle.diagnose import VehicleDiagnosis, diagnose_vehicle
from ident.effects import Effect
from ident.effects.combining import combined
from ident.effects.extended import ExtendedModel, simulation_of
from ident.effects.text import parse_effect
from ident.errors import UserError as UserError
from ident.estimate.identify import identify as identify_record
from ident.estimate.least_squares import ORDINARY, Estimator
from ident.estimate.least_squares import LeastSquares as LeastSquares
from ident.estimate.least_squares import WeightedLeastSquares as WeightedLeastSquares
from ident.estimate.result import Identification, KnownInertia
from ident.extras import named_engine, require_engine
from ident.faults import find_faults
from ident.plant.modes import Mode as Mode
from ident.plant.simulation import Motion as Motion
from ident.plant.simulation import Trajectory
from ident.records.files import read_record as read_file
from ident.records.record import Record
from ident.vehicle.description import VehicleDescription
from ident.vehicle.description import load_vehicle as load_vehicle
from ident.writing import write_whole

if TYPE_CHECKING:
    from hil.bench.emulation import Bench


def read_record(path: str | Path) -> Record:
    """The record of a run folder, decoded from its frames, or of a CSV, Parquet or MDF4 file.

    Raises:
        UserError: it is missing, of unknown kind, damaged, or breaks the contract of docs/logs.md.
    """
    path = Path(path)
    return read_run(path) if RunFolder(path).manifest.is_file() else read_file(path)


def identify(
    record: Record,
    vehicle: VehicleDescription,
    *,
    known_inertia: KnownInertia | None = None,
    estimator: Estimator = ORDINARY,
) -> Identification:
    """The eleven parameters (18) with their intervals.

    Args:
        record: of the campaign's steps.
        vehicle: its geometry is taken as true.
        known_inertia: B_w, where no wheel was lifted.
        estimator: `LeastSquares()`, `WeightedLeastSquares()`, or one of your own.

    Raises:
        UserError: a step or an excitation is missing, named.
    """
    return identify_record(record, vehicle.geometry, known_inertia=known_inertia, estimator=estimator)


def assess(result: Identification, record: Record, vehicle: VehicleDescription) -> Assessment:
    """Whether a result can be true: `good`, `doubtful` or `unusable`, with reasons. Ask before you build on it."""
    return assess_result(result, record, vehicle, find_faults(record, vehicle))


def model_of(result: Identification, effects: Sequence[Effect] = ()) -> ExtendedModel:
    """The model that an identification found, with effects beside it."""
    return ExtendedModel(result.parameters, tuple(effects), lag=result.lag)


def diagnose(
    fit: Sequence[Record],
    confirm: Sequence[Record],
    vehicle: VehicleDescription,
    model: ExtendedModel | None = None,
) -> VehicleDiagnosis:
    """Which effects the model lacks, where, how sure that is, and what to drive next.

    Args:
        fit: records that causes are looked for in.
        confirm: other records of the same vehicle; none: a part of `fit` confirms.
        vehicle: its geometry is taken as true.
        model: under test; None: parameters are refitted, only structure can be missing.

    Raises:
        UserError: a record is of another vehicle, does not move, or holds none of the steps of a diagnosis.
    """
    return diagnose_vehicle(fit, confirm, vehicle, model)


def extend(
    model: ExtendedModel, found: VehicleDiagnosis | Sequence[Effect | str], vehicle: VehicleDescription
) -> ExtendedModel:
    """The model with what a diagnosis found, its parameters refitted; or with effects as `name@place=size`.

    Args:
        model: under test.
        found: a diagnosis of it, or effects.
        vehicle: for what the records of a diagnosis do not show.

    Raises:
        UserError: a text names no effect.
    """
    if isinstance(found, VehicleDiagnosis):
        return extended_model(found.findings, vehicle.prior, given=model.effects, lag=model.lag)
    effects = [parse_effect(one) if isinstance(one, str) else one for one in found]
    return replace(model, effects=combined(model.effects, effects))


def simulate(
    model: ExtendedModel,
    vehicle: VehicleDescription,
    mode: Mode,
    start: Motion,
    torques: NDArray[np.float64],
    sample_time: float,
) -> Trajectory:
    """Motion of one mode under motor torques (R, T, 4) [Nm], R runs side by side; wheels roll.

    Args:
        model: parameters and effects.
        vehicle: its geometry.
        mode: of (9).
        start: of the R runs.
        torques: as the drives report them, linear between the samples.
        sample_time: [s].

    Raises:
        FloatingPointError: a state stops being finite.
    """
    return simulation_of(model, mode, vehicle.geometry).run(start, torques, sample_time)


def export_fmu(model: ExtendedModel, vehicle: VehicleDescription, path: str | Path, *, fmi: int = 3) -> Path:
    """Write the model as an FMU for this computer, with motor torques for inputs.

    Args:
        model: parameters and effects.
        vehicle: geometry and limits.
        path: of the file to write.
        fmi: version of the standard, 2 or 3.

    Raises:
        UserError: there is no compiler, the version is another one, or the file cannot be written.
    """
    from fmu.compiling import check_platforms, find_compiler
    from fmu.description import FmiVersion
    from fmu.packaging import Order, build_fmu
    from fmu.platforms import host_platform
    from fmu.source import ModelSource
    from fmu.variables import Inputs

    if str(fmi) not in set(FmiVersion):
        raise UserError(f"There is no FMI {fmi} here.", f"Take one of: {', '.join(FmiVersion)}.")
    compiler, platforms = find_compiler(), (host_platform(),)
    check_platforms(compiler, platforms)
    source = ModelSource(vehicle, model.parameters, model.effects, {"run": "a model in memory"}, {})
    write_whole(build_fmu(source, Order(FmiVersion(str(fmi)), Inputs.TORQUE, platforms), compiler), Path(path))
    return Path(path)


@contextmanager
def open_bench(
    vehicle: str = "prototype", *, seed: int = 0, effects: Sequence[Effect | str] = (), engine: str | None = None
) -> Iterator[Bench]:
    """An emulated vehicle behind a CAN bus of this process, in lockstep: bus, clock, and hands that lift and lower it.

    Args:
        vehicle: shipped prototype by name, or the path of a vehicle file.
        seed: of its noise.
        effects: that it has beyond its file, `name@place=size`.
        engine: `pybullet` or `mujoco`; None: the first that is installed.

    Raises:
        UserError: a file, an effect or the engine cannot be used.
    """
    from hil.bench import emulation

    chosen = require_engine(None if engine is None else named_engine(engine), "A bench")
    wanted = [parse_effect(one) if isinstance(one, str) else one for one in effects]
    with emulation.bench(vehicle, seed, False, network_file_of(vehicle), wanted, engine=chosen) as bench:
        yield bench

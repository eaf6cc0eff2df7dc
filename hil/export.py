"""`quasiomni fmu`: from the folder of an identified run to an FMU."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from fmu.compiling import check_platforms, find_compiler
from fmu.packaging import Order, build_fmu
from fmu.platforms import Platform
from fmu.source import ModelSource
from hil.campaign.folder import open_run
from hil.workflow import progress, provenance_of
from ident.errors import DataFileError
from ident.vehicle.description import load_vehicle
from ident.vehicle.effect_text import read_effects
from ident.vehicle.parameters import read_parameters
from ident.vehicle.quantities import read_toml
from ident.writing import write_whole


@dataclass(frozen=True)
class Exported:
    """What was written."""

    path: Path
    size: int
    seconds: float


def source_of_run(path: Path, model: Path | None = None) -> ModelSource:
    """The model that a run identified, or another one of its vehicle.

    Args:
        path: run folder.
        model: a `parameters.toml`, extended by a diagnosis for one; None: that of the run.

    Raises:
        DataFileError: it is no run folder, or has not been identified yet, or the model cannot be used.
    """
    run = open_run(path)
    folder = run.folder
    if model is not None:
        return source_of_files(model, folder.vehicle, provenance_of(run) | {"model": model.name})
    if not folder.parameters.is_file():
        raise DataFileError(f"{path} has no parameters.toml yet.", f"Identify it first: quasiomni identify {path}.")
    return source_of_files(folder.parameters, folder.vehicle, provenance_of(run))


def source_of_files(parameters: Path, vehicle: Path, provenance: dict[str, str]) -> ModelSource:
    """The model of a file of parameters, with the effects in it, and a vehicle file.

    Raises:
        DataFileError: a file is missing or malformed, or has an effect twice.
    """
    return ModelSource(
        vehicle=load_vehicle(vehicle),
        parameters=read_parameters(parameters),
        effects=read_effects(read_toml(parameters), str(parameters)),
        provenance=provenance,
        documents={"parameters.toml": parameters.read_bytes(), "vehicle.toml": vehicle.read_bytes()},
    )


def export_run(run: Path, out: Path, order: Order, console: Console, model: Path | None = None) -> Exported:
    """Build the FMU of a run and write it.

    Raises:
        UserError: the run is not identified, there is no compiler for a platform, or the file cannot be written.
    """
    source, compiler = source_of_run(run, model), find_compiler()
    check_platforms(compiler, order.platforms)
    start = time.monotonic()
    with progress(console) as bars:
        task = bars.add_task(f"compiling ({compiler.name})", total=len(order.platforms))

        def done(_: Platform) -> None:
            bars.advance(task)

        content = build_fmu(source, order, compiler, done)
    write_whole(content, out)
    return Exported(out, len(content), time.monotonic() - start)

"""From the folder of an identified run to an FMU."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import count
from pathlib import Path

from fmu.compiling import check_platforms, find_compiler
from fmu.packaging import Order, build_fmu
from fmu.source import ModelSource
from hil.campaign.folder import RunFolder, open_run, sources_of
from hil.campaign.results import provenance_of
from ident.errors import DataFileError
from ident.parameters_file import read_model
from ident.vehicle.description import load_vehicle
from ident.writing import refuse_inputs, write_whole


@dataclass(frozen=True)
class Exported:
    """What was written."""

    path: Path
    size: int
    seconds: float


def source_of_run(path: Path, model: Path | None = None, *, force: bool = False) -> ModelSource:
    """The model that a run identified, or another one of its vehicle.

    Args:
        path: run folder.
        model: a `parameters.toml`, extended by a diagnosis for one; None: that of the run.
        force: take a model that was assessed as unusable.

    Raises:
        DataFileError: it is no run folder, or has not been identified yet, or the model cannot be used.
        UserError: the model was assessed as unusable.
    """
    run = open_run(path)
    folder = run.folder
    if model is not None:
        return source_of_files(model, folder.vehicle, provenance_of(run) | {"model": model.name}, force=force)
    if not folder.parameters.is_file():
        raise DataFileError(f"{path} has no parameters.toml yet.", f"Identify it first: quasiomni identify {path}.")
    return source_of_files(folder.parameters, folder.vehicle, provenance_of(run), force=force)


def source_of_files(parameters: Path, vehicle: Path, provenance: dict[str, str], *, force: bool = False) -> ModelSource:
    """The model of a file of parameters, with the effects in it, and a vehicle file.

    Raises:
        DataFileError: a file is missing or malformed, or has an effect twice.
        UserError: the parameters were assessed as unusable, and `force` is not set.
    """
    model = read_model(parameters, force=force)
    return ModelSource(
        vehicle=load_vehicle(vehicle),
        parameters=model.parameters,
        effects=model.effects,
        provenance=provenance,
        documents={"parameters.toml": parameters.read_bytes(), "vehicle.toml": vehicle.read_bytes()},
    )


Compiled = Callable[[str, int, int], None]
"""Called with the compiler, and the number of platforms compiled, and of all."""


def unheard(_compiler: str, _done: int, _total: int) -> None:
    """Nobody waits."""


def export_run(
    run: Path,
    out: Path,
    order: Order,
    model: Path | None = None,
    *,
    force: bool = False,
    compiled: Compiled = unheard,
) -> Exported:
    """Build the FMU of a run and write it.

    Args:
        run: folder, identified.
        out: file to write.
        order: version, inputs and platforms.
        model: a `parameters.toml` in place of that of the run.
        force: take a model that was assessed as unusable.
        compiled: called with the progress.

    Raises:
        UserError: the run is not identified, there is no compiler for a platform, or the file cannot be written or is
            one of the run.
    """
    refuse_inputs([out], [*sources_of(run), RunFolder(run).parameters, model])
    source, compiler = source_of_run(run, model, force=force), find_compiler()
    check_platforms(compiler, order.platforms)
    start, done, total = time.monotonic(), count(1), len(order.platforms)
    compiled(compiler.name, 0, total)
    content = build_fmu(source, order, compiler, lambda _: compiled(compiler.name, next(done), total))
    write_whole(content, out)
    return Exported(out, len(content), time.monotonic() - start)

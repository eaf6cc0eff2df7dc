"""From the folder of an identified run to its system: the vehicle, and the controller that drove it."""

from __future__ import annotations

import time
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fmu.compiling import check_platforms, find_compiler
from fmu.controller.table import ControllerSource
from fmu.platforms import Platform
from fmu.source import ModelSource, with_neutral
from fmu.system.packaging import System, build_system
from fmu.system.parameter_sets import NORMAL_95, Knowledge, ParameterSet, corners, effect_ends, model_set
from fmu.table import variable_table
from hil.campaign.folder import RunFolder, open_run, sources_of
from hil.cosimulation.export import Compiled, Exported, source_of_run
from ident.campaign.extended_reference import with_effects
from ident.effects.extended import ExtendedModel
from ident.plant.modes import Mode
from ident.records.record import Step
from ident.vehicle.parameters import PARAMETER_NAMES
from ident.vehicle.quantities import read_numbers, read_toml
from ident.writing import refuse_folder, refuse_inputs, write_whole

Array = NDArray[np.float64]

_RUN: Final = "run"
_DIAGNOSED: Final = "diagnosed"


def system_of_run(path: Path, model: Path | None = None, *, force: bool = False) -> System:
    """The vehicle that a run identified, the controller of its lane change, and its sets of parameters.

    Args:
        path: run folder, identified.
        model: what a diagnosis has found, from `diagnose --extended`; None: the model of the run alone.
        force: take a model that was assessed as unusable.

    Raises:
        DataFileError: it is no run folder, or has not been identified yet, or a model cannot be used.
        UserError: a model was assessed as unusable, and `force` is not set.
    """
    identified = source_of_run(path, force=force)
    chosen = identified if model is None else source_of_run(path, model, force=force)
    file = RunFolder(path).parameters if model is None else model
    return System(chosen, _controller(path, chosen), tuple(_sets(identified, chosen, file, model is not None)))


def _model_of(source: ModelSource) -> ExtendedModel:
    return ExtendedModel(source.parameters, source.effects)


def _controller(path: Path, source: ModelSource) -> ControllerSource:
    """As the campaign drives its validation: loops by the priors of its plan, feed-forward by what was found."""
    plan = open_run(path).plan
    reference = plan.reference(Step.LANE_CHANGE, source.parameters)
    if source.effects:
        reference = with_effects(reference, _model_of(source), plan.vehicle.geometry)
    loops = tuple(reference.tracks)
    designs = {loop: plan.designs[loop] for loop in loops}
    limits = {loop: plan.limits[loop] for loop in loops}
    return ControllerSource(plan.vehicle, reference, Mode.STEERED, designs, limits, source.provenance)


def _sets(identified: ModelSource, chosen: ModelSource, file: Path, diagnosed: bool) -> Iterator[ParameterSet]:
    floor = chosen.vehicle.limits.floor_friction
    run = model_set(_RUN, "as identified", _model_of(identified), chosen.effects, floor)
    base = run
    if diagnosed:
        base = model_set(_DIAGNOSED, "as diagnosed, with its effects", _model_of(chosen), (), floor)
        yield base
    if not run.values.keys() - _names(chosen):
        yield run
    yield from corners(base, _knowledge(file, chosen))
    yield from effect_ends(base, _model_of(chosen))


def _names(source: ModelSource) -> set[str]:
    """Of all variables of the vehicle."""
    table = variable_table(source.vehicle, source.parameters, with_neutral(source.effects))
    return {row.name for row in table.variables}


def _knowledge(file: Path, source: ModelSource) -> Knowledge:
    """Intervals and correlation as the file of parameters has them; it need not have any."""
    document = read_toml(file)
    values, std = source.parameters.values, source.parameters.std
    low, high = values - NORMAL_95 * std, values + NORMAL_95 * std
    for column, name in enumerate(PARAMETER_NAMES):
        interval = document["parameters"][name].get("ci95")
        if interval is not None:
            where = f"{file}: ci95 of {name}"
            low[column], high[column] = read_numbers(interval, (2,), where, "Identify the run again.")
    correlation = source.parameters.correlation
    return Knowledge(low, high, std, np.eye(len(values)) if correlation is None else correlation)


def _unheard(_compiler: str, _done: int, _total: int) -> None:
    """Nobody waits."""


def export_system(
    run: Path,
    out: Path,
    platforms: tuple[Platform, ...],
    model: Path | None = None,
    *,
    force: bool = False,
    compiled: Compiled = _unheard,
) -> Exported:
    """Build the system of a run and write it.

    Args:
        run: folder, identified.
        out: file to write.
        platforms: that its FMUs are for.
        model: what a diagnosis has found; None: the model of the run alone.
        force: take a model that was assessed as unusable.
        compiled: called with the progress.

    Raises:
        UserError: the run is not identified, there is no compiler for a platform, or the file cannot be written or is
            one of the run.
    """
    refuse_folder(out)
    refuse_inputs([out], [*sources_of(run), RunFolder(run).parameters, model])
    system, compiler = system_of_run(run, model, force=force), find_compiler()
    check_platforms(compiler, platforms)
    start, done, total = time.monotonic(), count(1), 2 * len(platforms)
    compiled(compiler.name, 0, total)
    content = build_system(system, platforms, compiler, lambda _: compiled(compiler.name, next(done), total))
    write_whole(content, out)
    return Exported(out, len(content), time.monotonic() - start)

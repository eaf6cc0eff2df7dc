"""A system as one file: the FMUs of vehicle and controller, how they are connected, and sets of parameters."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from typing import Final

from fmu.compiling import Compiler
from fmu.controller.packaging import build_controller
from fmu.controller.table import ControllerSource, controller_table
from fmu.description import FmiVersion
from fmu.interface import Experiment
from fmu.packaging import Order, archive_of, build_fmu, identifier_of
from fmu.platforms import Platform
from fmu.source import ModelSource, with_neutral
from fmu.system.parameter_sets import ParameterSet, parameter_set_file
from fmu.system.structure import CONTROLLER, RESOURCES, VEHICLE, Structure, structure_file
from fmu.table import variable_table
from fmu.variables import Inputs

DEFAULT: Final = "SystemStructure.ssd"
"""The structure that an importer takes unless told otherwise."""


@dataclass(frozen=True)
class System:
    """A vehicle with its controller.

    Attributes:
        vehicle: what its FMU is made from.
        controller: what its FMU is made from.
        sets: of parameters; the first is that of `SystemStructure.ssd`, each other one has a structure of its own.
    """

    vehicle: ModelSource
    controller: ControllerSource
    sets: Sequence[ParameterSet]


def build_system(
    system: System,
    platforms: tuple[Platform, ...],
    compiler: Compiler,
    progress: Callable[[Platform], None] = lambda _: None,
) -> bytes:
    """The system, a zip archive.

    Args:
        system: to build.
        platforms: that the FMUs are for.
        compiler: from `fmu.compiling.find_compiler`.
        progress: called with each platform of each FMU that is done.

    Raises:
        UserError: a compiler is missing or fails.
    """
    tool = f"quasiomni {version('quasiomni')}"
    order = Order(FmiVersion.FMI2, Inputs.TORQUE, platforms)
    files = {
        RESOURCES[VEHICLE]: build_fmu(system.vehicle, order, compiler, progress),
        RESOURCES[CONTROLLER]: build_controller(system.controller, platforms, compiler, progress),
    }
    for chosen in system.sets:
        files[_set_path(chosen)] = parameter_set_file(chosen, system.vehicle.vehicle, tool)
    default, *variants = system.sets
    files[DEFAULT] = structure_file(_structure(system, default, tool), _set_path(default))
    for chosen in variants:
        files[f"{chosen.name}.ssd"] = structure_file(_structure(system, chosen, tool), _set_path(chosen))
    documents = {f"documentation/{name}": content for name, content in system.vehicle.documents.items()}
    return archive_of(files | documents)


def _set_path(chosen: ParameterSet) -> str:
    return f"resources/{chosen.name}.ssv"


def _structure(system: System, chosen: ParameterSet, tool: str) -> Structure:
    source, reference = system.vehicle, system.controller.reference
    return Structure(
        name=f"{identifier_of(source.vehicle.name)}_{chosen.name}",
        description=f"{source.vehicle.name} and its controller in the step {reference.step}: {chosen.text}",
        tool=tool,
        vehicle=variable_table(source.vehicle, source.parameters, with_neutral(source.effects)),
        controller=controller_table(system.controller),
        experiment=Experiment(stop_time=round(reference.duration, 9), step_size=reference.sample_time),
    )

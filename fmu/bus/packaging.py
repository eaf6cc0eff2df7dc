"""An FMU of devices on a bus as one file: the same input gives the same bytes."""

from __future__ import annotations

import hashlib
import uuid
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import resources
from importlib.metadata import version
from pathlib import Path
from typing import Final

from fmu.attachments import build_description
from fmu.bus.description import LAYERED_STANDARD, bus_description, bus_manifest, bus_terminals
from fmu.bus.system import BusSystem, PlantPorts
from fmu.bus.tables import bus_tables
from fmu.compiling import Compiler, compile_libraries
from fmu.description import FmiVersion
from fmu.glue import wrapper_sources
from fmu.interface import Interface
from fmu.model.generate import generate_core
from fmu.packaging import LICENSE, Order, archive_of, binaries_of, fmu_interface
from fmu.platforms import Platform
from fmu.source import Model, ModelSource, with_neutral
from fmu.table import variable_table
from fmu.variables import Inputs, VariableTable
from ident.plant.contact import Contacts
from ident.vehicle.geometry import WHEELS

EPSILON: Final = 3e-4
"""ε of Coulomb friction at the start [rad/s]: how far a held joint creeps is proportional to it, and wheels off
straight ahead slip, which a campaign would take for friction (docs/fmu.md, "In the loop")."""

_INCLUDED: Final = {
    name: f"plant_{name.removesuffix('.c')}.h" for name in ("fmi3.c", "fmi3_solving.c", "fmi3_values.c")
}
"""A unit of the plant alone -> the name under which `plant.c` includes it."""


@dataclass(frozen=True)
class BusPlant:
    """What the devices sit on.

    Attributes:
        interface: its variables.
        files: C files of the model, by name, the functions of FMI excepted.
        ports: where drives act and encoders look.
        driven: names of the inputs that the drives set.
    """

    interface: Interface
    files: Mapping[str, bytes]
    ports: PlantPorts
    driven: tuple[str, ...]


def vehicle_plant(source: ModelSource) -> BusPlant:
    """The identified vehicle as a plant: motor torques in, angles out."""
    effects = with_neutral(source.effects)
    table = _with_start(variable_table(source.vehicle, source.parameters, effects), "epsilon", EPSILON)
    core = generate_core(table, effects, Inputs.TORQUE)
    model = Model(table, core.files, core.dependencies, core.fastest)
    interface = fmu_interface(source, model, Order(FmiVersion.FMI3, Inputs.TORQUE, (), Contacts.STIFF))
    described = f"Identified model of {source.vehicle.name} with its drives and encoders on CAN (FMI-LS-BUS)"
    torques = tuple(f"torque_{wheel}" for wheel in WHEELS)
    ports = PlantPorts(
        _references(table, torques),
        _references(table, [_reported(table, f"beta_{wheel}") for wheel in WHEELS]),
        _references(table, [_reported(table, f"beta_{wheel}_dot") for wheel in WHEELS]),
        _references(table, [_reported(table, name) for name in ("alpha_l", "alpha_r")]),
    )
    files = {name: text.encode() for name, text in core.files.items()}
    return BusPlant(replace(interface, description=described), files, ports, torques)


def _with_start(table: VariableTable, name: str, start: float) -> VariableTable:
    return VariableTable(tuple(replace(row, start=start) if row.name == name else row for row in table.variables))


def _reported(table: VariableTable, name: str) -> str:
    """What sensors report in place of a state, where delays or springs are between."""
    reported = f"{name}_reported"
    return reported if any(row.name == reported for row in table.variables) else name


def _references(table: VariableTable, names: Sequence[str]) -> tuple[int, ...]:
    return tuple(table[name].value_reference for name in names)


def build_bus_fmu(
    plant: BusPlant,
    system: BusSystem,
    documents: Mapping[str, bytes],
    platforms: Sequence[Platform],
    compiler: Compiler,
    progress: Callable[[Platform], None] = lambda _: None,
    cache: Path | None = None,
) -> bytes:
    """The FMU, a zip archive.

    Args:
        plant: what the devices sit on.
        system: the devices.
        documents: files that go along, by name.
        platforms: to build for.
        compiler: from `fmu.compiling.find_compiler`.
        progress: called with each platform that is done.
        cache: folder for sources; None for the user's cache folder.

    Raises:
        UserError: a compiler is missing or fails.
    """
    token = _token(plant, system)
    sources = bus_sources(plant, system, token)
    libraries = compile_libraries(sources, platforms, compiler, progress, cache)
    units = [name for name in sorted(sources) if name.endswith(".c")]
    eds = {f"resources/{node.name}.eds": system.devices[node.device].eds for node in system.nodes}
    return archive_of(
        {
            "modelDescription.xml": bus_description(plant.interface, system, plant.driven, token, units),
            **{f"sources/{name}": text for name, text in sources.items()},
            **binaries_of(libraries, FmiVersion.FMI3),
            "sources/CMakeLists.txt": (resources.files("fmu") / "data" / "CMakeLists.txt").read_bytes(),
            "sources/buildDescription.xml": build_description(units),
            "terminalsAndIcons/terminalsAndIcons.xml": bus_terminals(),
            f"extra/{LAYERED_STANDARD}/fmi-ls-manifest.xml": bus_manifest(),
            **eds,
            "documentation/licenses/license.txt": LICENSE.encode(),
            **{f"documentation/{name}": content for name, content in documents.items()},
        }
    )


def bus_sources(plant: BusPlant, system: BusSystem, token: str) -> dict[str, bytes]:
    """All C files of the FMU, the headers of FMI excepted."""
    wrapper = wrapper_sources(plant.interface.table, FmiVersion.FMI3, token)
    renamed = {_INCLUDED.get(name, name): text for name, text in wrapper.items()}
    own = {
        entry.name: entry.read_bytes()
        for folder in ("firmware", "wrapper")
        for entry in (resources.files("fmu.bus") / folder).iterdir()
        if entry.name.endswith((".c", ".h"))
    }
    return {**plant.files, **renamed, **own, **bus_tables(system, plant.ports)}


def _token(plant: BusPlant, system: BusSystem) -> str:
    """A UUID of all that the description and the C code are made from."""
    digest = hashlib.sha256(bus_description(plant.interface, system, plant.driven, version("quasiomni"), []))
    for name, text in sorted(bus_sources(plant, system, "").items()):
        digest.update(name.encode() + text)
    return f"{{{uuid.UUID(bytes=digest.digest()[:16], version=5)}}}"

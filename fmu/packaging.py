"""An FMU as one file: description, sources, binaries, documentation; the same input gives the same bytes."""

from __future__ import annotations

import hashlib
import io
import sys
import uuid
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import resources
from importlib.metadata import version
from pathlib import Path
from typing import Final

import numpy as np

from fmu.arrays import with_arrays
from fmu.attachments import build_description, terminals
from fmu.compiling import Compiler, compile_libraries, universal_binary
from fmu.description import FmiVersion, model_description
from fmu.documentation import documentation_page
from fmu.glue import wrapper_sources
from fmu.interface import MODEL_IDENTIFIER, Experiment, Interface, with_indicators
from fmu.platforms import PLATFORMS, Platform
from fmu.reference import Reference, reference_drive
from fmu.scene import scene
from fmu.source import Model, ModelSource, make_model, with_neutral
from fmu.variables import Carried, Inputs
from ident.errors import UserError
from ident.plant.contact import Contacts

INDICATORS: Final = 4
"""Event indicators of the model, one for each condition of (9)."""

_TIME: Final = (1980, 1, 1, 0, 0, 0)
"""Of every file in the archive: the earliest that the format knows."""

COPYRIGHT: Final = "Whoever identified the vehicle; source code of quasiomni under the licence named"

LICENSE: Final = """The source code of this FMU is part of quasiomni.

SPDX-License-Identifier: Apache-2.0

Licensed under the Apache License, Version 2.0; you may obtain a copy of the License at
http://www.apache.org/licenses/LICENSE-2.0. Unless required by applicable law or agreed to in writing, it is
distributed on an "AS IS" basis, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
"""


@dataclass(frozen=True)
class Order:
    """The FMU that is wanted.

    Attributes:
        version: of FMI.
        inputs: what drives the wheels.
        platforms: to build for.
        contacts: stiff for solvers that are implicit, soft for others.
        limited: torque inputs are limited to what the motors can; speed loops always are.
        arrays: of the four wheels beside scalars.
        carried: effects beside the confirmed ones, of size zero.

    Raises:
        UserError: arrays of a version that has none.
    """

    version: FmiVersion
    inputs: Inputs
    platforms: tuple[Platform, ...]
    contacts: Contacts = Contacts.STIFF
    limited: bool = False
    arrays: bool = False
    carried: Carried = Carried.STATELESS

    def __post_init__(self) -> None:
        if self.arrays and self.version is not FmiVersion.FMI3:
            raise UserError("FMI 2.0 has no arrays.", "Ask for them in FMI 3.0 (--fmi 3), or do without.")


def build_fmu(
    source: ModelSource,
    order: Order,
    compiler: Compiler,
    progress: Callable[[Platform], None] = lambda _: None,
    cache: Path | None = None,
) -> bytes:
    """The FMU, a zip archive.

    Args:
        source: of the model.
        order: what to build.
        compiler: from `fmu.compiling.find_compiler`.
        progress: called with each platform that is done.
        cache: folder for sources; None for the user's cache folder.

    Raises:
        UserError: a compiler is missing or fails.
    """
    model = make_model(source, order.inputs, order.contacts, order.limited, order.carried)
    interface = fmu_interface(source, model, order)
    token = token_of(model, interface, order.version)
    sources = fmu_sources(model, interface, order.version, token)
    libraries = compile_libraries(sources, order.platforms, compiler, progress, cache)
    reference = reference_drive(model.table, with_neutral(source.effects, order.carried), order.inputs)
    units = [name for name in sorted(sources) if name.endswith(".c")]
    description = model_description(interface, order.version, token, units)
    files = {
        "modelDescription.xml": description,
        **{f"sources/{name}": text for name, text in sources.items()},
        **binaries_of(libraries, order.version),
        "sources/CMakeLists.txt": (resources.files("fmu") / "data" / "CMakeLists.txt").read_bytes(),
        **{f"resources/{name}": content for name, content in reference.files().items()},
        "resources/vehicle.glb": scene(source.vehicle.geometry, reference, f"quasiomni {version('quasiomni')}"),
        **_documentation(source, interface, order, reference),
        **_VERSION_FILES[order.version](order.inputs, units),
    }
    return archive_of(files)


def fmu_sources(model: Model, interface: Interface, version: FmiVersion, token: str) -> dict[str, bytes]:
    """All C files of an FMU, the headers of FMI excepted, as the standard wants it."""
    core = {name: text.encode() for name, text in model.files.items()}
    return core | wrapper_sources(interface.table, version, token)


def fmu_interface(source: ModelSource, model: Model, order: Order) -> Interface:
    """An FMU of the model seen from outside, FMI 3.0 event indicators included."""
    table = with_indicators(model.table, INDICATORS)
    return Interface(
        name=f"quasiomni.{identifier_of(source.vehicle.name)}",
        description=f"Identified model of {source.vehicle.name}, {order.inputs} inputs, {order.contacts} contacts",
        version=version("quasiomni"),
        tool=f"quasiomni {version('quasiomni')}",
        copyright=COPYRIGHT,
        license="Apache-2.0",
        table=with_arrays(table) if order.arrays else table,
        dependencies=model.dependencies,
        experiment=_EXPERIMENTS[order.contacts](model),
    )


def _for_implicit_solvers(_model: Model) -> Experiment:
    return Experiment()


def _for_explicit_solvers(model: Model) -> Experiment:
    """A step within the fastest time constant, one digit of it."""
    digit = 10.0 ** np.floor(np.log10(model.fastest))
    return Experiment(step_size=float(f"{np.floor(model.fastest / digit) * digit:.0e}"))


_EXPERIMENTS: Final = {Contacts.STIFF: _for_implicit_solvers, Contacts.SOFT: _for_explicit_solvers}


def identifier_of(name: str) -> str:
    """A name of letters, digits and underscores."""
    return "".join(letter if letter.isalnum() else "_" for letter in name)


def token_of(model: Model, interface: Interface, version: FmiVersion) -> str:
    """A UUID of all that the description and the C code are made from."""
    without = model_description(interface, version, "", [])
    digest = hashlib.sha256(without)
    for name, text in sorted(fmu_sources(model, interface, version, "").items()):
        digest.update(name.encode() + text)
    return f"{{{uuid.UUID(bytes=digest.digest()[:16], version=5)}}}"


def binaries_of(libraries: Mapping[str, bytes], version: FmiVersion) -> dict[str, bytes]:
    """FMI 2.0 has one folder for macOS, whose library is then for both processors."""
    if version is FmiVersion.FMI3:
        return {
            f"binaries/{name}/{MODEL_IDENTIFIER}{PLATFORMS[name].suffix}": library
            for name, library in libraries.items()
        }
    darwin = {name: library for name, library in libraries.items() if PLATFORMS[name].folder_fmi2 == "darwin64"}
    whole = {**libraries, **(dict.fromkeys(darwin, universal_binary(darwin)) if len(darwin) > 1 else {})}
    return {
        f"binaries/{PLATFORMS[name].folder_fmi2}/{MODEL_IDENTIFIER}{PLATFORMS[name].suffix}": library
        for name, library in whole.items()
    }


def _documentation(source: ModelSource, interface: Interface, order: Order, reference: Reference) -> dict[str, bytes]:
    python = ".".join(str(part) for part in sys.version_info[:3])
    versions = {"quasiomni": version("quasiomni"), "casadi": version("casadi"), "python": python}
    page = documentation_page(source, interface, order.inputs, reference, versions)
    files = {"index.html": page.encode(), "licenses/license.txt": LICENSE.encode(), **source.documents}
    return {f"documentation/{name}": content for name, content in files.items()}


def _files_fmi2(_inputs: Inputs, _units: list[str]) -> dict[str, bytes]:
    return {"model.png": _picture("icon.png")}


def _files_fmi3(inputs: Inputs, units: list[str]) -> dict[str, bytes]:
    return {
        "sources/buildDescription.xml": build_description(units),
        "terminalsAndIcons/terminalsAndIcons.xml": terminals(inputs),
        "terminalsAndIcons/icon.svg": _picture("icon.svg"),
        "terminalsAndIcons/icon.png": _picture("icon.png"),
    }


_VERSION_FILES: Final = {FmiVersion.FMI2: _files_fmi2, FmiVersion.FMI3: _files_fmi3}


def _picture(name: str) -> bytes:
    return (resources.files("fmu") / "data" / name).read_bytes()


def archive_of(files: Mapping[str, bytes]) -> bytes:
    """A zip archive of files by name; the same files give the same bytes."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(files):
            entry = zipfile.ZipInfo(name, _TIME)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, files[name])
    return buffer.getvalue()

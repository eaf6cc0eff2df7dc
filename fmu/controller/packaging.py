"""The controller as one file, by the same wrapper, compiler and archive as the vehicle; FMI 2.0, Co-Simulation."""

from __future__ import annotations

import html
from collections.abc import Callable, Mapping
from importlib.metadata import version
from pathlib import Path

from fmu.compiling import Compiler, compile_libraries
from fmu.controller.generate import controller_model
from fmu.controller.table import ControllerSource
from fmu.description import FmiVersion, model_description
from fmu.interface import Experiment, Interface
from fmu.packaging import COPYRIGHT, LICENSE, archive_of, binaries_of, fmu_sources, identifier_of, token_of
from fmu.platforms import Platform
from fmu.source import Model
from fmu.variables import Block


def build_controller(
    source: ControllerSource,
    platforms: tuple[Platform, ...],
    compiler: Compiler,
    progress: Callable[[Platform], None] = lambda _: None,
    cache: Path | None = None,
) -> bytes:
    """The FMU of a controller, a zip archive.

    Args:
        source: reference and cascades.
        platforms: to build for.
        compiler: from `fmu.compiling.find_compiler`.
        progress: called with each platform that is done.
        cache: folder for sources; None for the user's cache folder.

    Raises:
        UserError: a compiler is missing or fails.
    """
    model = controller_model(source)
    interface = _interface(source, model)
    token = token_of(model, interface, FmiVersion.FMI2)
    sources = fmu_sources(model, interface, FmiVersion.FMI2, token)
    libraries = compile_libraries(sources, platforms, compiler, progress, cache)
    units = [name for name in sorted(sources) if name.endswith(".c")]
    return archive_of(
        {
            "modelDescription.xml": model_description(interface, FmiVersion.FMI2, token, units),
            **{f"sources/{name}": text for name, text in sources.items()},
            **binaries_of(libraries, FmiVersion.FMI2),
            "documentation/index.html": _page(interface, source.provenance).encode(),
            "documentation/licenses/license.txt": LICENSE.encode(),
        }
    )


def _interface(source: ControllerSource, model: Model) -> Interface:
    reference = source.reference
    return Interface(
        name=f"quasiomni.{identifier_of(source.vehicle.name)}_controller",
        description=f"Controller of {source.vehicle.name} in the step {reference.step}, sampled every "
        f"{reference.sample_time:g} s",
        version=version("quasiomni"),
        tool=f"quasiomni {version('quasiomni')}",
        copyright=COPYRIGHT,
        license="Apache-2.0",
        table=model.table,
        dependencies=model.dependencies,
        experiment=Experiment(stop_time=round(reference.duration, 9), step_size=reference.sample_time),
        sampled=True,
    )


def _page(interface: Interface, provenance: Mapping[str, str]) -> str:
    """What people read: what it is, when it acts, its variables."""
    rows = "\n".join(
        f"<tr><td>{html.escape(row.name)}</td><td>{row.causality.value}</td><td>{html.escape(row.unit)}</td>"
        f"<td>{'' if row.start is None else f'{row.start:.6g}'}</td><td>{html.escape(row.description)}</td></tr>"
        for row in interface.table.variables
        if row.block is not Block.TIME
    )
    origin = "".join(f"<li>{html.escape(name)}: {html.escape(value)}</li>" for name, value in provenance.items())
    sample_time = interface.experiment.step_size
    return f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{html.escape(interface.name)}</title>
<style>body {{ font: 15px/1.5 sans-serif; margin: 2em auto; max-width: 60em }}
td, th {{ padding: .1em .8em .1em 0; text-align: left; vertical-align: top }}</style></head><body>
<h1>{html.escape(interface.name)}</h1>
<p>{html.escape(interface.description)}: feed-forward torques and one cascade a coordinate, P on position around PI
on velocity. sample_time is {sample_time:g} s: a sample is due at every multiple of it, taken at the beginning of the
communication step that reaches it, with the inputs of that moment. Torques hold between samples. Communication steps
that are longer are refused. When the reference has ended, its last sample goes on.</p>
<ul>{origin}</ul>
<table><tr><th>variable</th><th>causality</th><th>unit</th><th>start</th><th>what</th></tr>
{rows}
</table></body></html>
"""

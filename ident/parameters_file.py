"""`parameters.toml`, read and written here alone: parameters, effects, and what an identification says of them.

| table | what | written by |
|---|---|---|
| `[source]` | where the values come from | all |
| `[parameters.NAME]` | value, unit, standard deviation, source; more where it was identified | all |
| `[geometry]` | lengths that the values hold for | all, where known |
| `[sampling]` | how late all torques act, in records of which interval | identification, where it shows |
| `[correlation]` | what the errors of the values have in common | all, where known |
| `[fit]`, `[[steps]]`, `[assessment]` | how well the values are known | identification |
| `[[effects]]` | what the model has beyond (1)-(21) | diagnosis |
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from ident.assessment import Assessment
from ident.assessment.file import assessment_text, refuse_unusable
from ident.effects.extended import ExtendedModel
from ident.effects.text import effects_text, read_effects
from ident.estimate.result import Estimate, Identification
from ident.vehicle.geometry import Geometry, geometry_text
from ident.vehicle.lag import lag_text, read_lag
from ident.vehicle.parameters import CORRELATION, PARAMETER_NAMES, PARAMETER_UNITS, Parameters, read_parameters
from ident.vehicle.quantities import read_toml
from ident.writing import write_whole

SCHEMA: Final = "quasiomni.parameters/1"
TABLE: Final = "parameters"


@dataclass(frozen=True)
class Identified:
    """What an identification knows of its parameters beyond value and standard deviation."""

    identification: Identification
    assessment: Assessment

    @property
    def model(self) -> ExtendedModel:
        """Its parameters, without effects."""
        return ExtendedModel(self.identification.parameters, lag=self.identification.lag)


def read_model(path: Path, *, force: bool = True) -> ExtendedModel:
    """The model of a file: parameters, and effects where it has any.

    Args:
        path: of the file.
        force: take a model that was assessed as unusable.

    Raises:
        DataFileError: the file cannot be used; says where.
        UserError: it was assessed as unusable, and `force` is not set.
    """
    document = read_toml(path)
    refuse_unusable(document, str(path), force=force)
    return ExtendedModel(read_parameters(path, TABLE), read_effects(document, str(path)), lag=read_lag(document, path))


def write_model(
    model: ExtendedModel,
    path: Path,
    provenance: Mapping[str, str],
    *,
    identified: Identified | None = None,
    geometry: Geometry | None = None,
) -> None:
    """Write the file whole or not at all; arguments as of `model_text`.

    Raises:
        UserError: it cannot be written.
    """
    write_whole(model_text(model, provenance, identified=identified, geometry=geometry), path)


def model_text(
    model: ExtendedModel,
    provenance: Mapping[str, str],
    *,
    identified: Identified | None = None,
    geometry: Geometry | None = None,
) -> str:
    """The file's text.

    Args:
        model: parameters and effects.
        provenance: which run, vehicle and version it comes from.
        identified: what else is known of the parameters; None: they come from a diagnosis.
        geometry: lengths that the parameters hold for; None: not said.
    """
    lines = [f'schema = "{SCHEMA}"', "", "[source]"]
    lines += [f"{key} = {json.dumps(value)}" for key, value in provenance.items()]
    for name in PARAMETER_NAMES:
        estimate = None if identified is None else identified.identification[name]
        lines += ["", f"[{TABLE}.{name}]", *_entry(name, model.parameters, estimate, provenance.get("run", "record"))]
    lines += _correlated(model.parameters)
    lines += [] if identified is None else _quality(identified.identification)
    sampled = "" if model.lag is None else lag_text(model.lag, provenance.get("run", "record"))
    assessed = "" if identified is None else assessment_text(identified.assessment)
    lengths = "" if geometry is None else geometry_text(geometry, provenance.get("vehicle", "vehicle file"))
    return "\n".join(lines) + "\n" + sampled + lengths + effects_text(model.effects) + assessed


def _entry(name: str, parameters: Parameters, estimate: Estimate | None, source: str) -> Iterator[str]:
    yield f"value = {parameters[name]:.9g}"
    yield f'unit = "{PARAMETER_UNITS[name]}"'
    yield f"std = {parameters.std_of(name):.6g}"
    if estimate is not None:
        low, high = estimate.ci95
        yield f"ci95 = [{low:.9g}, {high:.9g}]"
        for key in ("naive_std", "b_w_std", "independence"):
            yield f"{key} = {getattr(estimate, key):.6g}"
        source = f"{estimate.method}, {source}"
    yield f"source = {json.dumps(source)}"


def _correlated(parameters: Parameters) -> Iterator[str]:
    if parameters.correlation is not None:
        yield from ("", f"[{CORRELATION}]", f"names = {json.dumps(list(PARAMETER_NAMES))}", "matrix = [")
        for row in parameters.correlation:
            yield f"    [{', '.join(f'{value:.6f}' for value in row)}],"
        yield "]"


def _quality(identification: Identification) -> Iterator[str]:
    yield from ("", "[fit]", f"condition = {identification.condition:.6g}")
    for key, value in vars(identification.processing).items():
        yield f"{key} = {value!r}"
    for floor in identification.floors:
        yield from ("", "[[steps]]", f'step = "{floor.step}"', f'coordinate = "{floor.coordinate}"')
        for key in ("signal", "residual", "noise", "model_error", "nrmse"):
            yield f"{key} = {getattr(floor, key):.6g}"

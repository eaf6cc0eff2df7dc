"""`parameters.toml`: one table a parameter, with correlation, assessment and provenance beside them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from ident.assessment import Assessment
from ident.assessment.file import assessment_text
from ident.estimate.identify import Estimate, Identification
from ident.vehicle.geometry import Geometry, geometry_text
from ident.vehicle.parameters import PARAMETER_NAMES
from ident.writing import write_whole


def parameters_text(
    identification: Identification,
    assessment: Assessment,
    provenance: Mapping[str, str],
    geometry: Geometry | None = None,
) -> str:
    """The file's text; `provenance` says which run, vehicle and version it comes from, `geometry` which lengths."""
    source = provenance.get("run", "record")
    lines = ['schema = "quasiomni.parameters/1"', "", "[source]"]
    lines += [f"{key} = {json.dumps(value)}" for key, value in provenance.items()]
    for estimate in identification.estimates:
        lines += ["", f"[parameters.{estimate.name}]", *_entry(estimate, source)]
    lines += ["", "[correlation]", f"names = {json.dumps(list(PARAMETER_NAMES))}", "matrix = ["]
    lines += [f"    [{', '.join(f'{value:.6f}' for value in row)}]," for row in identification.correlation]
    lines += ["]", "", "[fit]", f"condition = {identification.condition:.6g}"]
    lines += [f"{key} = {value!r}" for key, value in vars(identification.processing).items()]
    for floor in identification.floors:
        lines += ["", "[[steps]]", f'step = "{floor.step}"', f'coordinate = "{floor.coordinate}"']
        numbers = ("signal", "residual", "noise", "model_error", "nrmse")
        lines += [f"{name} = {getattr(floor, name):.6g}" for name in numbers]
    lengths = "" if geometry is None else geometry_text(geometry, provenance.get("vehicle", source))
    return "\n".join(lines) + "\n" + lengths + assessment_text(assessment)


def write_parameters(
    identification: Identification,
    assessment: Assessment,
    path: Path,
    provenance: Mapping[str, str],
    geometry: Geometry | None = None,
) -> None:
    """Write the file whole or not at all.

    Raises:
        UserError: it cannot be written.
    """
    write_whole(parameters_text(identification, assessment, provenance, geometry), path)


def _entry(estimate: Estimate, source: str) -> list[str]:
    low, high = estimate.ci95
    return [
        f"value = {estimate.value:.9g}",
        f'unit = "{estimate.unit}"',
        f"std = {estimate.std:.6g}",
        f"ci95 = [{low:.9g}, {high:.9g}]",
        f"naive_std = {estimate.naive_std:.6g}",
        f"b_w_std = {estimate.b_w_std:.6g}",
        f"independence = {estimate.independence:.6g}",
        f"source = {json.dumps(f'{estimate.method}, {source}')}",
    ]

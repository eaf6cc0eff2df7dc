"""The documentation page inside an FMU, from the table of variables and the source of the model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import jinja2

from fmu.interface import MODEL_IDENTIFIER, Interface
from fmu.picture import picture_of
from fmu.reference import SUGGESTED_TOLERANCE, Reference
from fmu.source import ModelSource
from fmu.variables import Causality, Inputs, Variable
from ident.effects import Effect
from ident.report.digits import unit_text


@dataclass(frozen=True)
class _Row:
    """A line of a table of variables."""

    name: str
    description: str
    unit: str
    value: str
    std: str


def documentation_page(
    source: ModelSource, interface: Interface, inputs: Inputs, reference: Reference, versions: Mapping[str, str]
) -> str:
    """`index.html`, self-contained.

    Args:
        source: of the model.
        interface: its variables and default experiment.
        inputs: what drives the wheels.
        reference: the drive to check the FMU with.
        versions: of the programs that made the FMU, by name.
    """
    loader = jinja2.PackageLoader("fmu")
    environment = jinja2.Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    deviations = source.standard_deviations
    rows = {
        causality: _rows([row for row in interface.table.variables if row.causality is causality], deviations)
        for causality in Causality
    }
    return environment.get_template("index.html.j2").render(
        vehicle=source.vehicle.name,
        inputs=inputs,
        variables=rows,
        provenance={**source.provenance, **versions},
        effects=[_effect_text(effect) for effect in source.effects],
        documents=sorted(source.documents),
        picture=picture_of(source.vehicle.geometry),
        experiment=interface.experiment,
        model=MODEL_IDENTIFIER,
        reference_end={name: f"{values[-1]:.4f}" for name, values in reference.outputs.items()},
        reference_tolerance=f"{SUGGESTED_TOLERANCE:g}",
        reference_stop=reference.times[-1],
    )


def _rows(variables: Sequence[Variable], deviations: Mapping[str, float]) -> list[_Row]:
    return [
        _Row(
            name=row.name,
            description=row.description,
            unit=unit_text(row.unit),
            value="" if row.start is None else f"{row.start:.9g}",
            std=f"{deviations[row.name]:.2g}" if row.name in deviations else "",
        )
        for row in variables
    ]


def _effect_text(effect: Effect) -> str:
    numbers = (
        f"{name} = {quantity.value:.4g} ± {quantity.std:.2g} {unit_text(quantity.unit)}"
        for name, quantity in effect.parameters.items()
    )
    return f"{effect}: {', '.join(numbers)}"

"""`modelDescription.xml` of FMI 2.0 and 3.0, from one table of variables."""

from __future__ import annotations

import enum
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Final
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from fmu.arrays import with_array_inputs, write_array, write_unknowns
from fmu.interface import LOG_CATEGORIES, MODEL_IDENTIFIER, Interface, initial_of, number
from fmu.units import DisplayUnit
from fmu.variables import Block, Causality, Variable

NAMING: Final = "structured"
"""Names like `der(x_dot)` and `slope.chassis.angle` are parts of a hierarchy."""


class FmiVersion(enum.StrEnum):
    """Versions of the standard."""

    FMI2 = "2"
    FMI3 = "3"


def model_description(interface: Interface, version: FmiVersion, token: str, sources: Sequence[str]) -> bytes:
    """The file, UTF-8.

    Args:
        interface: what to describe.
        version: of FMI.
        token: instantiation token (GUID in FMI 2.0).
        sources: C files, for FMI 2.0; FMI 3.0 has `buildDescription.xml` for them.
    """
    return document(_WRITERS[version](interface, token, sources))


def document(root: Element) -> bytes:
    """An XML file, indented."""
    indent(root, "  ")
    text: bytes = tostring(root, encoding="utf-8", xml_declaration=True)
    return text + b"\n"


def _common(interface: Interface) -> dict[str, str]:
    return {
        "modelName": interface.name,
        "description": interface.description,
        "version": interface.version,
        "copyright": interface.copyright,
        "license": interface.license,
        "generationTool": interface.tool,
        "variableNamingConvention": NAMING,
    }


def _write_fmi2(interface: Interface, token: str, sources: Sequence[str]) -> Element:
    indicators = str(len(interface.table.block(Block.INDICATOR)))
    root = Element("fmiModelDescription", _common(interface), fmiVersion="2.0", guid=token)
    root.set("numberOfEventIndicators", indicators)
    for kind, flags in (_SAMPLED_FMI2 if interface.sampled else _KINDS_FMI2).items():
        element = SubElement(root, kind, {"modelIdentifier": MODEL_IDENTIFIER, **flags})
        files = SubElement(element, "SourceFiles")
        for name in sources:
            SubElement(files, "File", name=name)
    _units(root, interface)
    _categories(root)
    _experiment(root, interface)
    variables = SubElement(root, "ModelVariables")
    for row in interface.table.variables:
        _variable_fmi2(variables, row, interface)
    structure = SubElement(root, "ModelStructure")
    groups = {
        "Outputs": interface.outputs,
        "Derivatives": interface.table.block(Block.DERIVATIVE),
        "InitialUnknowns": interface.initial_unknowns,
    }
    for name, rows in groups.items():
        if not rows:
            continue
        group = SubElement(structure, name)
        for row in rows:
            known = None if name == "InitialUnknowns" else interface.dependencies_of(row)
            SubElement(group, "Unknown", {"index": str(row.value_reference + 1), **_dependencies(known, first=1)})
    return root


def _write_fmi3(interface: Interface, token: str, _sources: Sequence[str]) -> Element:
    root = Element("fmiModelDescription", _common(interface), fmiVersion="3.0", instantiationToken=token)
    for kind, flags in _KINDS_FMI3.items():
        SubElement(root, kind, {"modelIdentifier": MODEL_IDENTIFIER, **flags})
    _units(root, interface)
    _categories(root)
    _experiment(root, interface)
    variables = SubElement(root, "ModelVariables")
    for row in interface.table.variables:
        _variable_fmi3(variables, row, interface)
    for array in interface.table.arrays:
        write_array(variables, array, _attributes_fmi3(array.row))
    structure = SubElement(root, "ModelStructure")
    groups = {
        "Output": interface.outputs,
        "ContinuousStateDerivative": interface.table.block(Block.DERIVATIVE),
        "InitialUnknown": interface.initial_unknowns,
        "EventIndicator": interface.table.block(Block.INDICATOR),
    }
    for name, rows in groups.items():
        for row in rows:
            known = None if name == "InitialUnknown" else _knowns_fmi3(interface, row)
            attributes = {"valueReference": str(row.value_reference), **_dependencies(known, first=0)}
            SubElement(structure, name, attributes)
        if name in ("Output", "InitialUnknown"):
            write_unknowns(structure, name, interface.table)
    return root


def _knowns_fmi3(interface: Interface, row: Variable) -> tuple[Variable, ...] | None:
    known = interface.dependencies_of(row)
    return None if known is None else with_array_inputs(interface.table, known)


def _dependencies(known: Sequence[Variable] | None, *, first: int) -> dict[str, str]:
    """FMI 2.0 counts variables from one, FMI 3.0 names value references. At initialization all that is set counts."""
    if known is None:
        return {}
    return {"dependencies": " ".join(str(row.value_reference + first) for row in known)}


_WRITERS: Final[Mapping[FmiVersion, Callable[[Interface, str, Sequence[str]], Element]]] = MappingProxyType(
    {FmiVersion.FMI2: _write_fmi2, FmiVersion.FMI3: _write_fmi3}
)

_STATE_FMI2: Final = {
    "canNotUseMemoryManagementFunctions": "true",
    "canGetAndSetFMUstate": "true",
    "canSerializeFMUstate": "true",
    "providesDirectionalDerivative": "true",
}
_KINDS_FMI2: Final[Mapping[str, Mapping[str, str]]] = MappingProxyType(
    {
        "ModelExchange": _STATE_FMI2,
        "CoSimulation": {
            "canHandleVariableCommunicationStepSize": "true",
            "canInterpolateInputs": "true",
            "maxOutputDerivativeOrder": "1",
            **_STATE_FMI2,
        },
    }
)

_SAMPLED_FMI2: Final[Mapping[str, Mapping[str, str]]] = MappingProxyType(
    {
        "CoSimulation": {
            "canHandleVariableCommunicationStepSize": "true",
            "canNotUseMemoryManagementFunctions": "true",
            "canGetAndSetFMUstate": "true",
            "canSerializeFMUstate": "true",
        }
    }
)
"""Of what acts at instants of its own."""

_STATE_FMI3: Final = {
    "canGetAndSetFMUState": "true",
    "canSerializeFMUState": "true",
    "providesDirectionalDerivatives": "true",
    "providesAdjointDerivatives": "true",
}
_KINDS_FMI3: Final[Mapping[str, Mapping[str, str]]] = MappingProxyType(
    {
        "ModelExchange": _STATE_FMI3,
        "CoSimulation": {
            "canHandleVariableCommunicationStepSize": "true",
            "maxOutputDerivativeOrder": "1",
            "providesIntermediateUpdate": "true",
            "canReturnEarlyAfterIntermediateUpdate": "true",
            "mightReturnEarlyFromDoStep": "true",
            "hasEventMode": "true",
            **_STATE_FMI3,
        },
    }
)


def _units(root: Element, interface: Interface) -> None:
    definitions = SubElement(root, "UnitDefinitions")
    for unit in interface.units:
        element = SubElement(definitions, "Unit", name=unit.name)
        SubElement(element, "BaseUnit", {base: str(power) for base, power in unit.exponents.items()})
        for display in unit.display:
            _display_unit(element, display)


def _display_unit(element: Element, display: DisplayUnit) -> None:
    SubElement(element, "DisplayUnit", name=display.name, factor=number(display.factor))


def _categories(root: Element) -> None:
    categories = SubElement(root, "LogCategories")
    for name, text in LOG_CATEGORIES.items():
        SubElement(categories, "Category", name=name, description=text)


def _experiment(root: Element, interface: Interface) -> None:
    values = interface.experiment
    SubElement(
        root,
        "DefaultExperiment",
        startTime=number(values.start_time),
        stopTime=number(values.stop_time),
        tolerance=number(values.tolerance),
        stepSize=number(values.step_size),
    )


def _head(row: Variable) -> dict[str, str]:
    head = {
        "name": row.name,
        "valueReference": str(row.value_reference),
        "description": row.description,
        "causality": row.causality.value,
        "variability": row.variability.value,
    }
    if initial_of(row):
        head["initial"] = initial_of(row)
    return head


def _bounds(row: Variable, write: Callable[[float], str]) -> dict[str, str]:
    bounds = {"min": row.minimum, "max": row.maximum}
    return {name: write(value) for name, value in bounds.items() if value is not None}


def _real(row: Variable) -> dict[str, str]:
    values = {"unit": row.unit}
    if row.display_unit:
        values["displayUnit"] = row.display_unit
    values |= _bounds(row, number)
    if row.block in (Block.STATE, Block.INPUT):
        values["nominal"] = number(row.nominal)
    if row.start is not None:
        values["start"] = number(row.start)
    return values


def _variable_fmi2(parent: Element, row: Variable, interface: Interface) -> None:
    element = SubElement(parent, "ScalarVariable", _head(row))
    if row.block is Block.MODE:
        SubElement(element, "Integer", _bounds(row, lambda value: str(int(value))))
        return
    values = _real(row)
    if row.state:
        values["derivative"] = str(interface.table[row.state].value_reference + 1)
    SubElement(element, "Real", values)


def _variable_fmi3(parent: Element, row: Variable, interface: Interface) -> None:
    if row.block is Block.MODE:
        SubElement(parent, "Int32", _head(row) | _bounds(row, lambda value: str(int(value))))
        return
    values = _attributes_fmi3(row)
    if row.state:
        values["derivative"] = str(interface.table[row.state].value_reference)
    SubElement(parent, "Float64", values)


def _attributes_fmi3(row: Variable) -> dict[str, str]:
    values = _head(row) | _real(row)
    if row.causality in (Causality.INPUT, Causality.OUTPUT):
        values["intermediateUpdate"] = "true"
    return values

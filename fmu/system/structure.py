"""`SystemStructure.ssd` of SSP 1.0: what is in the system, and what is connected with what."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final
from xml.etree.ElementTree import Element, SubElement

from fmu.description import document
from fmu.interface import Experiment, number
from fmu.system.parameter_sets import VEHICLE, add_units
from fmu.variables import Causality, Variable, VariableTable
from ident.vehicle.geometry import WHEELS

CONTROLLER: Final = "controller"

RESOURCES: Final = {VEHICLE: "resources/vehicle.fmu", CONTROLLER: "resources/controller.fmu"}
"""Where the components are in the archive."""

_NAMESPACES: Final = {
    "xmlns:ssd": "http://ssp-standard.org/SSP1/SystemStructureDescription",
    "xmlns:ssc": "http://ssp-standard.org/SSP1/SystemStructureCommon",
}

_SURROUNDINGS: Final = ("slope_x", "slope_y", "payload")
"""Inputs of the vehicle that are inputs of the system."""

_MOTION: Final = ("pose_x", "pose_y", "gamma", "x_dot", "y_dot", "gamma_dot")
"""Outputs of the vehicle that are outputs of the system, beside those of the controller that tell how well it follows."""


@dataclass(frozen=True)
class Connection:
    """Of a connector of an element with that of another; an element without a name is the system."""

    start: str
    start_connector: str
    end: str
    end_connector: str


@dataclass(frozen=True)
class Structure:
    """A system of two components.

    Attributes:
        name: of the system.
        description: one line for people.
        tool: that made it.
        vehicle, controller: their variables.
        experiment: defaults of a simulation.
    """

    name: str
    description: str
    tool: str
    vehicle: VariableTable
    controller: VariableTable
    experiment: Experiment

    @property
    def connections(self) -> tuple[Connection, ...]:
        """Torques one way, measured angles the other; floor and load in, motion and how it is followed out."""
        told = {row.name for row in self.vehicle.variables}
        torques = [(CONTROLLER, f"torque_{wheel}", VEHICLE, f"torque_{wheel}") for wheel in WHEELS]
        measured = [
            (VEHICLE, f"{name}_reported" if f"{name}_reported" in told else name, CONTROLLER, name)
            for name in (*(f"beta_{wheel}" for wheel in WHEELS), "alpha_l", "alpha_r")
        ]
        inner = [Connection(*ends) for ends in (*torques, *measured)]
        inwards = [Connection("", name, VEHICLE, name) for name in _SURROUNDINGS]
        outwards = [Connection(VEHICLE, name, "", name) for name in _MOTION]
        outwards += [Connection(CONTROLLER, name, "", name) for name in self._followed()]
        return (*inner, *inwards, *outwards)

    def _followed(self) -> list[str]:
        outputs = (row for row in self.controller.variables if row.causality is Causality.OUTPUT)
        return [row.name for row in outputs if row.name.startswith(("error_", "reference_", "path_"))]

    def table_of(self, element: str) -> VariableTable:
        """Variables of a component."""
        return {VEHICLE: self.vehicle, CONTROLLER: self.controller}[element]


def structure_file(structure: Structure, binding: str) -> bytes:
    """The file.

    Args:
        structure: to describe.
        binding: set of parameters that the system has, in the archive.
    """
    root = Element("ssd:SystemStructureDescription", _NAMESPACES, version="1.0", name=structure.name)
    root.set("description", structure.description)
    root.set("generationTool", structure.tool)
    system = SubElement(root, "ssd:System", name="system", description=structure.description)
    _connectors(system, [(one, kind) for one, kind in _outer(structure)])
    bindings = SubElement(system, "ssd:ParameterBindings")
    SubElement(bindings, "ssd:ParameterBinding", type="application/x-ssp-parameter-set", source=binding)
    elements = SubElement(system, "ssd:Elements")
    for name, source in RESOURCES.items():
        attributes = {"type": "application/x-fmu-sharedlibrary", "implementation": "CoSimulation"}
        component = SubElement(elements, "ssd:Component", attributes, name=name, source=source)
        _connectors(component, _inner(structure, name))
    lines = SubElement(system, "ssd:Connections")
    for connection in structure.connections:
        SubElement(lines, "ssd:Connection", _ends(connection))
    rows = [row for row, _ in (*_outer(structure), *(pair for name in RESOURCES for pair in _inner(structure, name)))]
    add_units(SubElement(root, "ssd:Units"), dict.fromkeys(row.unit for row in rows))
    experiment = structure.experiment
    times = {"startTime": number(experiment.start_time), "stopTime": number(experiment.stop_time)}
    SubElement(root, "ssd:DefaultExperiment", times)
    return document(root)


def _outer(structure: Structure) -> list[tuple[Variable, str]]:
    found = [(structure.table_of(one.end)[one.end_connector], "input") for one in structure.connections if not one.start]
    found += [
        (structure.table_of(one.start)[one.start_connector], "output") for one in structure.connections if not one.end
    ]
    return found


def _inner(structure: Structure, element: str) -> list[tuple[Variable, str]]:
    table = structure.table_of(element)
    inputs = [(one.end_connector, "input") for one in structure.connections if one.end == element]
    outputs = [(one.start_connector, "output") for one in structure.connections if one.start == element]
    return [(table[name], kind) for name, kind in dict.fromkeys((*inputs, *outputs))]


def _connectors(parent: Element, rows: list[tuple[Variable, str]]) -> None:
    group = SubElement(parent, "ssd:Connectors")
    for row, kind in rows:
        connector = SubElement(group, "ssd:Connector", name=row.name, kind=kind, description=row.description)
        SubElement(connector, "ssc:Real", unit=row.unit)


def _ends(connection: Connection) -> dict[str, str]:
    named = {"startElement": connection.start, "endElement": connection.end}
    ends = {"startConnector": connection.start_connector, "endConnector": connection.end_connector}
    return {name: value for name, value in named.items() if value} | ends

"""`SystemStructure.ssd` of SSP 1.0: what is in the system, and what is connected with what.

Connectors and bindings are those of the components: importers that read those of a system as well are fewer.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final
from xml.etree.ElementTree import Element, SubElement

from fmu.description import document
from fmu.interface import Experiment, number
from fmu.system.parameter_sets import add_units
from fmu.variables import Causality, Variable, VariableTable
from ident.vehicle.geometry import WHEELS

VEHICLE: Final = "vehicle"
CONTROLLER: Final = "controller"

RESOURCES: Final = {VEHICLE: "resources/vehicle.fmu", CONTROLLER: "resources/controller.fmu"}
"""Where the components are in the archive."""

_NAMESPACES: Final = {
    "xmlns:ssd": "http://ssp-standard.org/SSP1/SystemStructureDescription",
    "xmlns:ssc": "http://ssp-standard.org/SSP1/SystemStructureCommon",
}

_MOTION: Final = ("pose_x", "pose_y", "gamma", "x_dot", "y_dot", "gamma_dot")
"""Outputs of the vehicle that are shown; of the controller it is all that it puts out."""


@dataclass(frozen=True)
class Connection:
    """From an output of an element to an input of another."""

    start: str
    output: str
    end: str
    input: str


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
        """Torques one way; the other way angles, as the encoders report them where that is not what they are."""
        told = {row.name for row in self.vehicle.variables}
        torques = [(CONTROLLER, f"torque_{wheel}", VEHICLE, f"torque_{wheel}") for wheel in WHEELS]
        measured = [
            (VEHICLE, f"{name}_reported" if f"{name}_reported" in told else name, CONTROLLER, name)
            for name in (*(f"beta_{wheel}" for wheel in WHEELS), "alpha_l", "alpha_r")
        ]
        return tuple(Connection(*ends) for ends in (*torques, *measured))

    def connectors(self, element: str) -> list[tuple[Variable, str]]:
        """Variables of a component that are connected or shown, each with its kind."""
        table = {VEHICLE: self.vehicle, CONTROLLER: self.controller}[element]
        inputs = [(one.input, "input") for one in self.connections if one.end == element]
        outputs = [(one.output, "output") for one in self.connections if one.start == element]
        shown = [(name, "output") for name in self._shown(element)]
        return [(table[name], kind) for name, kind in dict.fromkeys((*inputs, *outputs, *shown))]

    def _shown(self, element: str) -> tuple[str, ...]:
        outputs = (row for row in self.controller.variables if row.causality is Causality.OUTPUT)
        return _MOTION if element == VEHICLE else tuple(row.name for row in outputs if row.name != "mode")


def structure_file(structure: Structure, binding: str) -> bytes:
    """The file.

    Args:
        structure: to describe.
        binding: set of parameters that the vehicle has, in the archive.
    """
    root = Element("ssd:SystemStructureDescription", _NAMESPACES, version="1.0", name=structure.name)
    root.set("description", structure.description)
    root.set("generationTool", structure.tool)
    system = SubElement(root, "ssd:System", name="system", description=structure.description)
    elements = SubElement(system, "ssd:Elements")
    for name, source in RESOURCES.items():
        attributes = {"type": "application/x-fmu-sharedlibrary", "implementation": "CoSimulation"}
        component = SubElement(elements, "ssd:Component", attributes, name=name, source=source)
        _connectors(component, structure.connectors(name))
        if name == VEHICLE:
            bindings = SubElement(component, "ssd:ParameterBindings")
            SubElement(bindings, "ssd:ParameterBinding", type="application/x-ssp-parameter-set", source=binding)
    lines = SubElement(system, "ssd:Connections")
    for one in structure.connections:
        elements_of = {"startElement": one.start, "endElement": one.end}
        SubElement(lines, "ssd:Connection", elements_of, startConnector=one.output, endConnector=one.input)
    used = [row.unit for name in RESOURCES for row, _ in structure.connectors(name)]
    add_units(SubElement(root, "ssd:Units"), dict.fromkeys(used))
    experiment = structure.experiment
    times = {"startTime": number(experiment.start_time), "stopTime": number(experiment.stop_time)}
    SubElement(root, "ssd:DefaultExperiment", times)
    return document(root)


def _connectors(parent: Element, rows: list[tuple[Variable, str]]) -> None:
    group = SubElement(parent, "ssd:Connectors")
    for row, kind in rows:
        connector = SubElement(group, "ssd:Connector", name=row.name, kind=kind, description=row.description)
        SubElement(connector, "ssc:Real", unit=row.unit)

"""`modelDescription.xml`, terminals and manifest of devices on a bus, from those of their plant (FMI-LS-BUS 1.0)."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Final
from xml.etree.ElementTree import Element, SubElement, fromstring

from fmu.bus.system import BusSystem, TxClock
from fmu.description import FmiVersion, document, model_description
from fmu.interface import MODEL_IDENTIFIER, Interface, number
from fmu.variables import Block, Variable

NETWORK: Final = "CAN"
"""Name of the bus terminal, and first part of the names of its variables."""

RX_DATA, RX_CLOCK, TX_DATA, TX_CLOCK = (
    f"{NETWORK}.{member}" for member in ("Rx_Data", "Rx_Clock", "Tx_Data", "Tx_Clock")
)

TORQUE_NOISE: Final = "noise.torque"
ENCODER_NOISE: Final = "noise.encoder"
SEED: Final = "noise.seed"
FRAMES_LOST: Final = "frames_lost"

MIME_TYPE: Final = 'application/org.fmi-standard.fmi-ls-bus.can; version="1.0.0"'

LAYERED_STANDARD: Final = "org.fmi-standard.fmi-ls-bus"
_VERSION: Final = "1.0.0"
_SUMMARY: Final = (
    "Layered Standard for the simulation of bus communication on a Physical Signal Abstraction or Network Abstraction "
    "based level."
)
_MANIFEST_NAMESPACE: Final = "http://fmi-standard.org/fmi-ls-manifest"

_MAX_SIZE: Final = "16384"
"""Of Rx_Data and Tx_Data [bytes]: QB_BYTES."""

_LEFT_OUT: Final = (Block.DERIVATIVE, Block.INDICATOR, Block.CALCULATED)
"""Blocks of the plant that only solvers have a use for."""

_CAUSALITY: Final = {TxClock.COUNTDOWN: "input", TxClock.TRIGGERED: "output"}
"""Of Tx_Clock; a countdown is a wish to whoever makes the ticks."""

_CO_SIMULATION: Final = {
    "canHandleVariableCommunicationStepSize": "true",
    "canGetAndSetFMUState": "true",
    "hasEventMode": "true",
}


def bus_description(
    interface: Interface, system: BusSystem, driven: Collection[str], token: str, sources: Sequence[str]
) -> bytes:
    """`modelDescription.xml`.

    Args:
        interface: of the plant.
        system: devices and noise.
        driven: inputs of the plant that the drives set; they are outputs here.
        token: instantiation token.
        sources: C files.
    """
    root = fromstring(model_description(interface, FmiVersion.FMI3, token, sources))
    for element in root.findall("ModelExchange") + root.findall("CoSimulation"):
        root.remove(element)
    root.insert(0, Element("CoSimulation", {"modelIdentifier": MODEL_IDENTIFIER, **_CO_SIMULATION}))
    variables, structure = _found(root, "ModelVariables"), _found(root, "ModelStructure")
    _adapt(variables, interface, driven)
    first = len(interface.table.variables)
    _add_terminal_variables(variables, system.tx_clock, first)
    _add_settings(variables, system, first)
    for element in list(structure):
        structure.remove(element)
    _add_structure(structure, interface, driven, first, triggered=system.tx_clock is TxClock.TRIGGERED)
    return document(root)


def _found(root: Element, name: str) -> Element:
    element = root.find(name)
    if element is None:
        raise LookupError(f"The description of the plant has no {name}.")
    return element


def _adapt(variables: Element, interface: Interface, driven: Collection[str]) -> None:
    rows = {row.name: row for row in interface.table.variables}
    for element in list(variables):
        name = element.get("name", "")
        if rows[name].block in _LEFT_OUT:
            variables.remove(element)
        elif name in driven:
            for attribute in ("start", "min", "max", "nominal"):
                element.attrib.pop(attribute, None)
            element.attrib |= {"causality": "output", "initial": "calculated"}
        element.attrib.pop("derivative", None)
        element.attrib.pop("intermediateUpdate", None)


def _add_terminal_variables(variables: Element, tx_clock: TxClock, first: int) -> None:
    data = {"variability": "discrete", "mimeType": MIME_TYPE, "maxSize": _MAX_SIZE}
    clock = {"variability": "discrete"}
    received = SubElement(
        variables,
        "Binary",
        {"name": RX_DATA, "valueReference": str(first), "causality": "input", **data, "clocks": str(first + 1)},
        description="Operations of the bus for the devices",
    )
    SubElement(received, "Start", value="")
    SubElement(
        variables,
        "Clock",
        {"name": RX_CLOCK, "valueReference": str(first + 1), "causality": "input", **clock},
        intervalVariability="triggered",
        description="Ticks with Rx_Data",
    )
    SubElement(
        variables,
        "Binary",
        {"name": TX_DATA, "valueReference": str(first + 2), "causality": "output", **data, "clocks": str(first + 3)},
        initial="calculated",
        description="Operations of the devices for the bus",
    )
    SubElement(
        variables,
        "Clock",
        {"name": TX_CLOCK, "valueReference": str(first + 3), "causality": _CAUSALITY[tx_clock], **clock},
        intervalVariability=tx_clock.value,
        description="Ticks where a device has something to send or a timer of one is due",
    )


def _add_settings(variables: Element, system: BusSystem, first: int) -> None:
    noises = {
        TORQUE_NOISE: (system.torque_noise, "Noise of torque readings, rms, of rated torque"),
        ENCODER_NOISE: (system.encoder_noise, "Noise ahead of the rounding to increments, rms [increments]"),
    }
    for place, (name, (start, text)) in enumerate(noises.items(), start=first + 4):
        attributes = {"name": name, "valueReference": str(place), "causality": "parameter", "variability": "tunable"}
        bounds = {"min": "0.0", "max": "1000.0", "start": number(start)}
        SubElement(variables, "Float64", {**attributes, **bounds}, description=text)
    attributes = {"name": SEED, "valueReference": str(first + 6), "causality": "parameter", "variability": "fixed"}
    SubElement(variables, "Int32", attributes, start="1", description="Seed of the noise")
    attributes = {"name": FRAMES_LOST, "valueReference": str(first + 7), "causality": "output"}
    SubElement(
        variables,
        "UInt32",
        attributes,
        variability="discrete",
        initial="calculated",
        description="Frames that found the queue full since nobody took Tx_Data",
    )


def _add_structure(
    structure: Element, interface: Interface, driven: Collection[str], first: int, *, triggered: bool
) -> None:
    outputs = [str(row.value_reference) for row in interface.table.variables if _is_output(row, driven)]
    for reference in outputs:
        SubElement(structure, "Output", valueReference=reference)
    SubElement(structure, "Output", valueReference=str(first + 2), dependencies=str(first + 3))
    if triggered:
        SubElement(structure, "Output", valueReference=str(first + 3))
    SubElement(structure, "Output", valueReference=str(first + 7))
    calculated = [
        str(row.value_reference)
        for row in interface.table.variables
        if _is_output(row, driven) and (row.start is None or row.name in driven)
    ]
    for reference in (*calculated, *([str(first + 3)] if triggered else []), str(first + 7)):
        SubElement(structure, "InitialUnknown", valueReference=reference)


def _is_output(row: Variable, driven: Collection[str]) -> bool:
    return row.name in driven or (row.causality.value == "output" and row.block not in _LEFT_OUT)


def bus_terminals() -> bytes:
    """`terminalsAndIcons.xml`: the bus terminal of the devices."""
    root = Element("fmiTerminalsAndIcons", fmiVersion="3.0")
    terminal = SubElement(
        SubElement(root, "Terminals"),
        "Terminal",
        name=NETWORK,
        terminalKind="org.fmi-ls-bus.network-terminal",
        matchingRule="org.fmi-ls-bus.transceiver",
        description="CAN bus with the CANopen devices of the vehicle",
    )
    for name in (TX_DATA, TX_CLOCK, RX_DATA, RX_CLOCK):
        member = {"variableName": name, "memberName": name.removeprefix(f"{NETWORK}.")}
        SubElement(terminal, "TerminalMemberVariable", member, variableKind="signal")
    return document(root)


def bus_manifest() -> bytes:
    """`extra/org.fmi-standard.fmi-ls-bus/fmi-ls-manifest.xml`."""
    root = Element("fmiLayeredStandardManifest", {"xmlns:fmi-ls": _MANIFEST_NAMESPACE})
    values = {"name": LAYERED_STANDARD, "version": _VERSION, "description": _SUMMARY}
    for name, value in values.items():
        root.set(f"fmi-ls:fmi-ls-{name}", value)
    root.set("isBusSimulationFMU", "false")
    return document(root)

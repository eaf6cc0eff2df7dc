"""XML files of FMI 3.0 beside the model description: terminals with icon, and how the sources are built."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final
from xml.etree.ElementTree import Element, SubElement

from fmu.compiling import FLAGS
from fmu.description import document
from fmu.interface import MODEL_IDENTIFIER
from fmu.variables import Inputs
from ident.vehicle.geometry import WHEELS

_COMMANDS: Final = {Inputs.TORQUE: "torque", Inputs.SPEED: "speed"}

_CHASSIS: Final = ("pose_x", "pose_y", "gamma", "x_dot", "y_dot", "gamma_dot", "mode")
_SIDES: Final = {"left": "l", "right": "r"}
_ENVIRONMENT: Final = ("slope_x", "slope_y", "payload")

_ICON_SIZE: Final = 100
"""Side of the square that the icon fills, in units of the coordinate system [mm]."""


def terminals(inputs: Inputs) -> bytes:
    """`terminalsAndIcons.xml`: a plug for each drive and steering side, one for the chassis, one for what it stands on.

    Args:
        inputs: what drives the wheels.
    """
    root = Element("fmiTerminalsAndIcons", fmiVersion="3.0")
    picture = SubElement(root, "GraphicalRepresentation")
    corners = {"x1": "0", "y1": "0", "x2": str(_ICON_SIZE), "y2": str(_ICON_SIZE)}
    SubElement(picture, "CoordinateSystem", corners, suggestedScalingFactorTo_mm="0.2")
    SubElement(picture, "Icon", corners)
    group = SubElement(root, "Terminals")
    for wheel in WHEELS:
        command = f"{_COMMANDS[inputs]}_{wheel}"
        members = {"command": command, "angle": f"beta_{wheel}", "rate": f"beta_{wheel}_dot"}
        members["torque"] = f"drive_torque_{wheel}"
        _plug(group, f"drive_{wheel}", f"Wheel drive {wheel}", members)
    for side, letter in _SIDES.items():
        members = {"angle": f"alpha_{letter}", "rate": f"alpha_{letter}_dot", "reported": f"alpha_{letter}_reported"}
        _plug(group, f"steering_{side}", f"Steering, {side}", members)
    _plug(group, "chassis", "Motion of the chassis", {name: name for name in _CHASSIS})
    _plug(group, "environment", "Floor and load", {name: name for name in _ENVIRONMENT})
    return document(root)


def _plug(group: Element, name: str, description: str, members: dict[str, str]) -> None:
    terminal = SubElement(group, "Terminal", name=name, matchingRule="plug", description=description)
    for member, variable in members.items():
        attributes = {"variableName": variable, "memberName": member, "variableKind": "signal"}
        SubElement(terminal, "TerminalMemberVariable", attributes)


def build_description(sources: Sequence[str]) -> bytes:
    """`buildDescription.xml` for C files; the headers of FMI come from whoever builds.

    Args:
        sources: names of the files to compile.
    """
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = SubElement(
        root, "BuildConfiguration", modelIdentifier=MODEL_IDENTIFIER, description="Any C99 compiler"
    )
    options = " ".join(flag for flag in FLAGS if flag.startswith(("-O", "-f")))
    files = SubElement(configuration, "SourceFileSet", language="C99", compilerOptions=options)
    for name in sources:
        SubElement(files, "SourceFile", name=name)
    SubElement(configuration, "Library", name="m", description="Mathematical functions of C")
    return document(root)

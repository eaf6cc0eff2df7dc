"""What the firmware reads from a network file: node ids, roles and EDS files; the rest is the master's."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ident.errors import DataFileError
from ident.vehicle.quantities import read_toml, require_table

DRIVE_ROLES = ("drive_fl", "drive_rl", "drive_fr", "drive_rr")
ENCODER_ROLES = ("encoder_left", "encoder_right")


@dataclass(frozen=True)
class NodeDescription:
    """One node: its address, what it is on the vehicle, and its EDS file."""

    node_id: int
    role: str
    eds: Path


@dataclass(frozen=True)
class NetworkDescription:
    """The nodes in ascending order of their ids."""

    nodes: tuple[NodeDescription, ...]


def read_network_description(path: Path) -> NetworkDescription:
    """Read the part of a network file that concerns the devices.

    Raises:
        DataFileError: the file is missing or malformed, or names a role that does not exist.
    """
    document = read_toml(path)
    devices = require_table(document, "devices", path)
    nodes = []
    for entry in document.get("nodes", ()):
        if entry.get("role") not in DRIVE_ROLES + ENCODER_ROLES:
            raise DataFileError(
                f"{path}: node {entry.get('id')} has role {entry.get('role')!r}.",
                f"Use one of {', '.join(DRIVE_ROLES + ENCODER_ROLES)}.",
            )
        device = require_table(devices, str(entry.get("device")), path)
        nodes.append(NodeDescription(int(entry["id"]), entry["role"], path.parent / str(device.get("eds"))))
    nodes.sort(key=lambda node: node.node_id)
    return NetworkDescription(tuple(nodes))

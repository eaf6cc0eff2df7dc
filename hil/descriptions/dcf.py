"""DCF files (CiA 306): the EDS of a node with its address and the values that the master gives it."""

from __future__ import annotations

import re
from collections.abc import Mapping

from hil.network import Network, Node
from hil.network.cia import CobId, Index

_SECTION = re.compile(r"^\[(?P<name>.+)\]\s*$")
_OBJECT = re.compile(r"^(?P<index>[0-9A-F]{4})(?:sub(?P<subindex>[0-9A-F]+))?$", re.IGNORECASE)


def configured_values(node: Node, network: Network) -> dict[tuple[int, int], int]:
    """(index, sub-index) -> what the master writes to a node before it starts it: PDOs and heartbeats."""
    quantities = node.quantities
    timeout = round(quantities["heartbeat_timeout"].value * 1000.0)
    values: dict[tuple[int, int], int] = {
        (Index.CONSUMER_HEARTBEAT_TIME, 1): network.master_id << 16 | timeout,
        (Index.PRODUCER_HEARTBEAT_TIME, 0): round(quantities["heartbeat_period"].value * 1000.0),
    }
    sync = node.object_dictionary.get_variable(Index.SYNC_COB_ID)
    if sync is not None and sync.default != network.sync_cob_id:
        values[Index.SYNC_COB_ID, 0] = network.sync_cob_id
    for pdo in node.pdos:
        present = node.object_dictionary.get_variable(pdo.communication_index, 1)
        default = 0 if present is None else present.default or 0
        values[pdo.communication_index, 1] = default & CobId.NO_REMOTE | pdo.cob_id(node.node_id)
        values[pdo.communication_index, 2] = pdo.transmission_type
        values[pdo.mapping_index, 0] = len(pdo.objects)
        for subindex, item in enumerate(pdo.objects, start=1):
            values[pdo.mapping_index, subindex] = item.mapping_entry
    return values


def write_dcf(node: Node, network: Network, eds_name: str | None = None) -> str:
    """The DCF of a node; `eds_name` is what it calls its EDS file, None for the name that this has.

    Raises:
        OSError: its EDS file cannot be read.
    """
    values = configured_values(node, network)
    lines = []
    for line in node.eds.read_text(encoding="utf-8").splitlines():
        header = _SECTION.match(line)
        lines.append(line)
        if header is not None:
            lines += _added(header["name"], eds_name or node.eds.name, node, values)
    return "\n".join([*lines, "", *_commissioning(node, network)]) + "\n"


def _added(section: str, eds_name: str, node: Node, values: Mapping[tuple[int, int], int]) -> list[str]:
    if section == "FileInfo":
        return [f"LastEDS={eds_name}"]
    name = _OBJECT.match(section)
    if name is None:
        return []
    value = values.get((int(name["index"], 16), int(name["subindex"] or "0", 16)))
    if value is None or not _is_variable(name["subindex"], node, int(name["index"], 16)):
        return []
    return [f"ParameterValue=0x{value:X}"]


def _is_variable(subindex: str | None, node: Node, index: int) -> bool:
    """The section of a record itself carries no value; that of its sub-index 0 does."""
    return subindex is not None or not hasattr(node.object_dictionary[index], "subindices")


def _commissioning(node: Node, network: Network) -> list[str]:
    # The name of the section is misspelt in the standard itself.
    return [
        "[DeviceComissioning]",
        f"NodeID=0x{node.node_id:02X}",
        f"NodeName={node.role}",
        f"Baudrate={network.bit_rate / 1000.0:.0f}",
        "NetNumber=1",
        f"NetworkName={network.name}",
        "CANopenManager=0",
    ]

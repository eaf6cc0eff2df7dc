"""What a network file must satisfy as a whole before anybody sends a frame by it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

from hil.network.cia import Service
from hil.network.description import Network, Node, Role
from ident.errors import DataFileError

SHORTEST_TIME: Final = 0.001
LONGEST_TIME: Final = 65.535
"""Range of the heartbeat objects 1016h and 1017h [s]: whole milliseconds in 16 bits."""

_SERVICES: Final = {
    "EMCY": Service.EMERGENCY,
    "SDO response": Service.SDO_ANSWER,
    "SDO request": Service.SDO_REQUEST,
    "heartbeat": Service.HEARTBEAT,
}
"""Identifiers of a node besides its PDOs (CiA 301, predefined connection set)."""


def check_complete(nodes: Sequence[Node], path: Path) -> None:
    """See that every role is there once, every node id at most once.

    Raises:
        DataFileError: a role is missing, or a role or a node id is given twice.
    """
    for what in ("role", "node_id"):
        found = [getattr(node, what) for node in nodes]
        doubled = {item for item in found if found.count(item) > 1}
        if doubled:
            raise DataFileError(
                f"{path}: {what} {', '.join(map(str, doubled))} is given twice.", "Give each node its own."
            )
    missing = [role for role in Role if role not in {node.role for node in nodes}]
    if missing:
        raise DataFileError(f"{path} has no node for {', '.join(missing)}.", "Add a [[nodes]] entry for each.")


def check_positive(values: Mapping[str, float], where: str) -> None:
    """See that numbers which are divided by, or waited for, are above zero.

    Raises:
        DataFileError: one is not.
    """
    for name, value in values.items():
        if not (value > 0 and math.isfinite(value)):
            raise DataFileError(f"{where}.{name} = {value:g} cannot be.", "It must be positive.")


def check_network(network: Network) -> None:
    """See that identifiers are unique, heartbeats can be kept, and PDOs come every cycle and fit into it.

    Raises:
        DataFileError: with the node, the identifier, the PDO or the time in question.
    """
    _check_identifiers(network)
    for node in network.nodes:
        _check_heartbeats(node, network)
        _check_every_cycle(node, network)
    if network.worst_bus_load > 1.0:
        raise DataFileError(
            f"{network.path}: the PDOs of a cycle need up to {network.worst_bus_load:.0%} of the bus.",
            "Map fewer objects, make the cycle longer, or raise the bit rate.",
        )


def _identifiers(network: Network) -> Iterator[tuple[int, str]]:
    yield 0, "NMT"
    yield network.sync_cob_id, "the SYNC"
    yield Service.HEARTBEAT + network.master_id, "the heartbeat of the master"
    for node in network.nodes:
        yield from ((base + node.node_id, f"{name} of {node.label}") for name, base in _SERVICES.items())
        yield from ((pdo.cob_id(node.node_id), f"a {pdo.direction} PDO of {node.label}") for pdo in node.pdos)


def _check_identifiers(network: Network) -> None:
    users: dict[int, str] = {}
    for can_id, user in _identifiers(network):
        if can_id in users:
            raise DataFileError(
                f"{network.path}: {users[can_id]} and {user} both use identifier {can_id:03X}h.",
                "Choose other node ids, PDO numbers, or another sync_cob_id (usual: 0x80).",
            )
        users[can_id] = user


def _check_heartbeats(node: Node, network: Network) -> None:
    for name in ("heartbeat_period", "heartbeat_timeout"):
        value = node.quantities[name].value
        if not SHORTEST_TIME <= value <= LONGEST_TIME:
            raise DataFileError(
                f"{network.path}: {name} of {node.label} is {value:g} s.",
                f"Give {SHORTEST_TIME} s to {LONGEST_TIME} s, whole milliseconds.",
            )
    period, timeout = network.times["heartbeat_period"], node.quantities["heartbeat_timeout"].value
    if timeout <= period:
        raise DataFileError(
            f"{network.path}: {node.label} trips after {timeout:g} s without a heartbeat of the master, which sends "
            f"one every {period:g} s.",
            "Make heartbeat_timeout of the device at least twice heartbeat_period of [master.times].",
        )


def _check_every_cycle(node: Node, network: Network) -> None:
    for pdo in node.pdos:
        if pdo.transmission_type != 1:
            raise DataFileError(
                f"{network.path}: {pdo.direction} PDO {pdo.number} of {node.label} has transmission type "
                f"{pdo.transmission_type}, but a torque and a sample are exchanged at every SYNC.",
                "Set transmission_type = 1.",
            )

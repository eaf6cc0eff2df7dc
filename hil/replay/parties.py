"""Who sends which identifier, by the predefined connection set and the network file."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from typing import Final

from hil.network import Network, Node, Pdo, PdoDirection
from hil.network.cia import FUNCTION_CODE, NODE_ID, PDO_SPACING, Service


class Answer(StrEnum):
    """What a node sends."""

    SAMPLE = "PDO"
    SDO = "SDO"
    EMERGENCY = "EMCY"
    STATE = "NMT state"


_TPDOS: Final = 4
"""TPDOs of a node that the predefined connection set has identifiers for."""

_FUNCTIONS: Final[Mapping[int, Answer]] = {
    Service.EMERGENCY: Answer.EMERGENCY,
    **{Service.TPDO_1 + k * PDO_SPACING: Answer.SAMPLE for k in range(_TPDOS)},
    Service.SDO_ANSWER: Answer.SDO,
    Service.HEARTBEAT: Answer.STATE,
}


class Parties:
    """The nodes of a network and whoever else is on its bus.

    Args:
        network: the network file.
    """

    def __init__(self, network: Network) -> None:
        self._sync = network.sync_cob_id
        self._nodes = {node.node_id: node for node in network.nodes}
        self._pdos = {
            pdo.cob_id(node.node_id): (node, pdo)
            for node in network.nodes
            for pdo in node.pdos
            if pdo.direction is PdoDirection.TRANSMIT
        }

    @property
    def samples(self) -> Mapping[int, tuple[Node, Pdo]]:
        """Identifiers of the PDOs that the network file says the nodes send with the SYNC."""
        return self._pdos

    def sender(self, can_id: int) -> Node | None:
        """The node that sends an identifier; None for the master, and for whoever is not in the network file."""
        if can_id in self._pdos:
            return self._pdos[can_id][0]
        if can_id == self._sync or can_id & FUNCTION_CODE not in _FUNCTIONS:
            return None
        return self._nodes.get(can_id & NODE_ID)

    def kind(self, can_id: int) -> Answer:
        """What an identifier of a node carries."""
        return Answer.SAMPLE if can_id in self._pdos else _FUNCTIONS[can_id & FUNCTION_CODE]

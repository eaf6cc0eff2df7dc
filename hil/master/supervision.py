"""Heartbeats in both directions, and the emergencies that the nodes have sent."""

from __future__ import annotations

import struct

from hil.master.errors import NodeLostError
from hil.master.link import Link
from hil.network import Network, Node
from hil.network.cia import NMT_STATE, Service

_OPERATIONAL = 5
_PRE_OPERATIONAL = 127
_LOST_AFTER = 3
"""Heartbeat periods without a heartbeat after which a node counts as lost."""


class Supervision:
    """Sends the master's heartbeat and watches those of the nodes, in the time of the cycles.

    Args:
        link: the bus.
        network: the network file.
    """

    def __init__(self, link: Link, network: Network) -> None:
        self._link = link
        self._heartbeat_id = Service.HEARTBEAT + network.master_id
        self._period = network.times["heartbeat_period"]
        self._nodes = {node.node_id: node for node in network.nodes}
        self._next_beat = float("-inf")
        self._now = self._started = 0.0
        self._heard: dict[int, float] = {}
        self._states: dict[int, int] = {}
        self._emergencies: dict[int, tuple[int, int]] = {}
        for node_id in self._nodes:
            link.subscribe(Service.HEARTBEAT + node_id, self._on_heartbeat)
            link.subscribe(Service.EMERGENCY + node_id, self._on_emergency)

    def start(self, now: float) -> None:
        """The nodes are operational from `now` [s] on."""
        self._now = self._started = now
        self._next_beat = now
        self._heard = dict.fromkeys(self._nodes, now)
        self._states = dict.fromkeys(self._nodes, _OPERATIONAL)

    def tick(self, now: float) -> None:
        """Once a cycle: send the heartbeat when it is due, and then look after the nodes.

        Raises:
            NodeLostError: a node has been silent for three heartbeat periods, or is not operational any more.
        """
        self._now = now
        if now >= self._next_beat:
            self._next_beat = now + self._period
            self._link.send_message(self._heartbeat_id, bytes((_OPERATIONAL,)))
            for node in self._nodes.values():
                self._check(node)

    def emergency(self, node: Node) -> str:
        """The last emergency of a node, for error texts; empty if there was none."""
        if node.node_id not in self._emergencies:
            return ""
        code, register = self._emergencies[node.node_id]
        return f"; its last emergency was {code:04X}h, error register {register:#04x}"

    def _check(self, node: Node) -> None:
        state = self._states[node.node_id]
        if state != _OPERATIONAL:
            raise NodeLostError(
                f"{node.label} has left the NMT state operational (its heartbeat says {state}){self.emergency(node)}.",
                "Look for what reset or stopped it, then start again.",
            )
        silence = self._now - self._heard[node.node_id]
        if silence > _LOST_AFTER * node.quantities["heartbeat_period"].value:
            raise NodeLostError(
                f"{node.label} has sent no heartbeat for {silence:.2f} s.",
                "Check its supply and cable, then start again.",
            )

    def _on_heartbeat(self, can_id: int, data: bytearray, _timestamp: float) -> None:
        node_id = can_id - Service.HEARTBEAT
        self._heard[node_id] = self._now
        if data and not (data[0] & NMT_STATE == _PRE_OPERATIONAL and self._may_be_late(node_id)):
            self._states[node_id] = data[0] & NMT_STATE

    def _may_be_late(self, node_id: int) -> bool:
        """Whether a heartbeat may have been on its way as the node was started, and say what it was before."""
        return self._now - self._started <= self._nodes[node_id].quantities["heartbeat_period"].value

    def _on_emergency(self, can_id: int, data: bytearray, _timestamp: float) -> None:
        if len(data) >= 3:
            self._emergencies[can_id - Service.EMERGENCY] = struct.unpack_from("<HB", data)

"""All devices of one vehicle on one bus: frames in, frames out, and time."""

from __future__ import annotations

from collections.abc import Callable

from emulator.firmware.description import (
    DRIVE_ROLES,
    ENCODER_ROLES,
    NetworkDescription,
    NodeDescription,
)
from emulator.firmware.drive import DriveApplication
from emulator.firmware.encoder import EncoderApplication
from emulator.firmware.hardware import VehicleHardware
from emulator.firmware.node import Application, Node, NodeBus
from emulator.firmware.timers import Timers

_HEARTBEATS = range(0x701, 0x780)


class DeviceNetwork:
    """The emulated nodes; their time moves only by `advance`, and they send only from within a call.

    Args:
        vehicle: the hardware they sit on.
        description: which node is where.
        send: transmits a frame (CAN identifier, data).
    """

    def __init__(
        self,
        vehicle: VehicleHardware,
        description: NetworkDescription,
        send: Callable[[int, bytes], None],
    ) -> None:
        self._vehicle = vehicle
        self._send = send
        self._timers = Timers(vehicle.time)
        self._moved = vehicle.time
        self._routes: dict[int, list[Callable[[int, bytes], None]]] = {}
        self._sync_cob_id = description.sync_cob_id
        self.nodes = {node.node_id: self._make_node(node) for node in description.nodes}
        self._find_listeners()
        for node in self._in_order:
            node.power_on()

    @property
    def time(self) -> float:
        """The instant that the devices have reached [s]."""
        return self._timers.now

    def receive(self, can_id: int, data: bytes) -> None:
        """Take a data frame from the bus; the answers go out before this returns."""
        if can_id == self._sync_cob_id:
            self._sync()
            return
        # A copy, because a handler may subscribe anew (NMT, PDO parameters).
        for handler in tuple(self._routes.get(can_id, ())):
            handler(can_id, data)
        if can_id == 0:
            for node in self._in_order:
                node.nmt.receive(data)
        elif can_id in _HEARTBEATS:
            for node in self._in_order:
                node.consumer.receive(can_id - 0x700)

    def advance(self, to_time: float) -> None:
        """Let time pass up to `to_time` [s]: physics, and the timers of the nodes in their order."""
        self._timers.run_until(to_time, self._move)

    def next_event(self) -> float:
        """Instant of the next timer [s], infinite if there is none."""
        return self._timers.next_event()

    def power_off(self, node_id: int) -> None:
        """The supply of a node fails: its power stage is off, it neither hears nor sends."""
        self.nodes[node_id].power_off()
        self._find_listeners()

    def power_on(self, node_id: int) -> None:
        """The supply of a node is back: it boots."""
        self.nodes[node_id].power_on()
        self._find_listeners()

    def bus_off(self, node_id: int) -> None:
        """The CAN controller of a node goes bus-off: it neither hears nor sends, its application goes on."""
        self.nodes[node_id].bus_off()
        self._find_listeners()

    def bus_on(self, node_id: int) -> None:
        """The CAN controller of a node has recovered from bus-off."""
        self.nodes[node_id].bus_on()
        self._find_listeners()

    def _find_listeners(self) -> None:
        self._in_order = tuple(node for node in self.nodes.values() if node.network.connected)

    def _sync(self) -> None:
        for node in self._in_order:
            node.latch()
        frames = [frame for node in self._in_order for frame in node.sync_frames()]
        # All nodes ask for the bus at once: the lowest identifier wins the arbitration.
        frames.sort()
        for can_id, data in frames:
            self._send(can_id, data)

    def _move(self, instant: float) -> None:
        # Counted here, because an engine of fixed steps shows no fractions of them in its own time.
        duration = round(instant - self._moved, 9)
        if duration > 0.0:
            self._moved = instant
            self._vehicle.advance(duration)

    def _make_node(self, description: NodeDescription) -> Node:
        def application(node: Node) -> Application:
            if description.role in DRIVE_ROLES:
                return DriveApplication(node, self._vehicle.drives[DRIVE_ROLES.index(description.role)])
            return EncoderApplication(node, self._vehicle.encoders[ENCODER_ROLES.index(description.role)])

        bus = NodeBus(self._routes, self._send)
        return Node(description.node_id, description.eds, bus, self._timers, application)

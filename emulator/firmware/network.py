"""All devices of one vehicle on one bus: frames in, frames out, and time."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from operator import itemgetter

from emulator.firmware.description import (
    DRIVE_ROLES,
    ENCODER_ROLES,
    NetworkDescription,
    NodeDescription,
)
from emulator.firmware.device import Device
from emulator.firmware.drive import DriveApplication
from emulator.firmware.encoder import EncoderApplication
from emulator.firmware.hardware import VehicleHardware
from emulator.firmware.node import Application, Node
from emulator.firmware.nodebus import NodeBus, Routes
from emulator.firmware.storage import Memory, VolatileMemory
from emulator.firmware.timers import Timers

_identifier = itemgetter(0)

_FRAME_TIME = 135e-6
"""When the other nodes hear a frame of a node [s]: 135 bits, 8 bytes with all stuff bits, at 1 Mbit/s."""

_IN_FLIGHT = 64
"""Frames between the nodes that may wait for the wire; further ones are lost, as in full transmit buffers."""


@dataclass(frozen=True)
class _SyncGroup:
    """The nodes that listen to one SYNC, and whether one without data needs no look by any of them."""

    nodes: tuple[Node, ...]
    plain: bool


class DeviceNetwork:
    """The emulated nodes; their time moves only by `advance`, and they send only from within a call.

    Args:
        vehicle: the hardware they sit on.
        description: which node is where.
        send: transmits a frame (CAN identifier, data).
        memory: where stored parameters outlive the nodes; without one, they outlive resets only.

    Attributes:
        nodes: the nodes by their node-IDs in the description, whatever LSS has made of them.
    """

    def __init__(
        self,
        vehicle: VehicleHardware,
        description: NetworkDescription,
        send: Callable[[int, bytes], None],
        memory: Memory | None = None,
    ) -> None:
        self._vehicle = vehicle
        self._send = send
        self._memory = VolatileMemory() if memory is None else memory
        self._timers = Timers(vehicle.time)
        self._moved = vehicle.time
        self.nodes: dict[int, Node] = {}
        self._devices: dict[int, Device] = {}
        self._groups: dict[int, _SyncGroup] = {}
        self._in_flight: deque[tuple[NodeBus, int, bytes]] = deque()
        self._free = 0.0
        self._routes = Routes(self._transmit, self._produce_sync, self._find_listeners)
        for node in description.nodes:
            device = self._devices[node.node_id] = self._make_device(node)
            self.nodes[node.node_id] = device.node
        for device in self._devices.values():
            device.power_on()

    @property
    def time(self) -> float:
        """The instant that the devices have reached [s]."""
        return self._timers.now

    def receive(self, can_id: int, data: bytes) -> None:
        """Take a data frame from the bus; the answers go out before this returns."""
        group = self._groups.get(can_id)
        if group is not None:
            self._sync(group.nodes, group.plain, data)
        # A copy, because a handler may subscribe anew (NMT, PDO parameters).
        for _, handler in tuple(self._routes.data.get(can_id, ())):
            handler(can_id, data)

    def receive_remote(self, can_id: int) -> None:
        """Take a remote frame from the bus; the answers go out before this returns."""
        for _, answer in tuple(self._routes.remote.get(can_id, ())):
            answer()

    def advance(self, to_time: float) -> None:
        """Let time pass up to `to_time` [s]: physics, and the timers of the nodes in their order."""
        self._timers.run_until(to_time, self._move)

    def next_event(self) -> float:
        """Instant of the next timer [s], infinite if there is none."""
        return self._timers.next_event()

    def power_off(self, node_id: int) -> None:
        """The supply of a node fails: its power stage is off, it neither hears nor sends."""
        self._devices[node_id].power_off()
        self._find_listeners()

    def power_on(self, node_id: int) -> None:
        """The supply of a node is back: it boots."""
        self._devices[node_id].power_on()
        self._find_listeners()

    def bus_off(self, node_id: int) -> None:
        """The CAN controller of a node goes bus-off: it neither hears nor sends, its application goes on."""
        self._devices[node_id].bus_off()
        self._find_listeners()

    def bus_on(self, node_id: int) -> None:
        """The CAN controller of a node has recovered from bus-off."""
        self._devices[node_id].bus_on()
        self._find_listeners()

    def _find_listeners(self) -> None:
        listeners = [node for node in self.nodes.values() if node.network.connected]
        self._groups = {
            can_id: _SyncGroup(nodes, all(node.sync.plain for node in nodes))
            for can_id in {node.network.sync_id for node in listeners}
            for nodes in [tuple(node for node in listeners if node.network.sync_id == can_id)]
        }

    def _sync(self, nodes: tuple[Node, ...], plain: bool, data: bytes) -> None:
        if data or not plain:
            nodes = tuple(node for node in nodes if node.accepts_sync(data))
        for node in nodes:
            node.latch()
        frames = [frame for node in nodes for frame in node.sync_frames()]
        # All nodes ask for the bus at once: the lowest identifier wins the arbitration.
        frames.sort(key=_identifier)
        for can_id, data, bus in frames:
            self._transmit(bus, can_id, data)

    def _produce_sync(self, can_id: int, data: bytes) -> None:
        self._send(can_id, data)
        self.receive(can_id, data)

    def _transmit(self, origin: NodeBus, can_id: int, data: bytes) -> None:
        self._send(can_id, data)
        if can_id in self._routes.data or can_id in self._groups:
            self._let_others_hear(origin, can_id, data)

    def _let_others_hear(self, origin: NodeBus, can_id: int, data: bytes) -> None:
        # One after the other, when the last bit has left the wire: PDOs that answer PDOs take time, as on a real bus.
        if len(self._in_flight) == _IN_FLIGHT:
            return
        self._in_flight.append((origin, can_id, data))
        self._free = max(self._free, self._timers.now) + _FRAME_TIME
        self._timers.after(self._free - self._timers.now, self._hear)

    def _hear(self) -> None:
        origin, can_id, data = self._in_flight.popleft()
        group = self._groups.get(can_id)
        if group is not None:
            self._sync(tuple(node for node in group.nodes if node.network is not origin), group.plain, data)
        for owner, handler in tuple(self._routes.data.get(can_id, ())):
            if owner is not origin:
                handler(can_id, data)

    def _move(self, instant: float) -> None:
        # Counted here, because an engine of fixed steps shows no fractions of them in its own time.
        duration = round(instant - self._moved, 9)
        if duration > 0.0:
            self._moved = instant
            self._vehicle.advance(duration)

    def _make_device(self, description: NodeDescription) -> Device:
        place = description.node_id

        def application(node: Node) -> Application:
            if description.role in DRIVE_ROLES:
                return DriveApplication(node, self._vehicle.drives[DRIVE_ROLES.index(description.role)])
            return EncoderApplication(node, self._vehicle.encoders[ENCODER_ROLES.index(description.role)])

        def make_node(node_id: int, renumbered: Callable[[], bool]) -> Node:
            bus, name = NodeBus(self._routes), f"node_{place}"
            return Node(node_id, description.eds, bus, self._timers, self._memory, name, application, renumbered)

        def replaced(node: Node) -> None:
            self.nodes[place] = node
            self._find_listeners()

        return Device(place, description.eds, NodeBus(self._routes), self._memory, make_node, replaced)

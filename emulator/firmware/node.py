"""One CANopen node: the services of CiA 301 around an object dictionary, and the application behind it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from emulator.firmware.dictionary import Dictionary
from emulator.firmware.emergency import Emergency, ErrorCode, ErrorRegister
from emulator.firmware.event_pdo import EventSender
from emulator.firmware.heartbeat import HeartbeatConsumer, HeartbeatProducer
from emulator.firmware.nmt import NmtSlave, NmtState
from emulator.firmware.pdo import PdoIndices, Rpdo, Tpdo
from emulator.firmware.sdo import SdoServer
from emulator.firmware.timers import Timers

_PDOS = 4

_ERROR_BEHAVIOUR = {0: NmtState.PRE_OPERATIONAL, 1: None, 2: NmtState.STOPPED}
"""1029h:1 -> the NMT state that a communication error leads to from operational (CiA 301, 7.5.2.32)."""


class Application(Protocol):
    """The device profile of a node: CiA 402 or CiA 406."""

    def reset(self) -> None:
        """Start afresh from the object dictionary."""

    def nmt_changed(self, state: NmtState) -> None:
        """The NMT state is another one now."""

    def rpdo_applied(self) -> None:
        """All values of an RPDO have been written."""

    def sample(self) -> None:
        """SYNC: take the process values of this instant."""

    def connection_lost(self) -> None:
        """The heartbeat of a node in 1016h is missing."""


class NodeBus:
    """The subscriptions of one node, as durand's services want them.

    Args:
        routes: CAN identifier -> handlers, shared by all nodes of the network.
        send: transmits a frame.
    """

    def __init__(
        self, routes: dict[int, list[Callable[[int, bytes], None]]], send: Callable[[int, bytes], None]
    ) -> None:
        self._routes = routes
        self._mine: dict[int, Callable[[int, bytes], None]] = {}
        self._transmit = send
        self.connected = True

    def send(self, cob_id: int, data: bytes) -> None:
        """Transmit a frame; nothing leaves a node that is off the bus."""
        if self.connected:
            self._transmit(cob_id, data)

    def connect(self) -> None:
        """Hear and send again."""
        if not self.connected:
            self.connected = True
            for cob_id, callback in self._mine.items():
                self._routes.setdefault(cob_id, []).append(callback)

    def disconnect(self) -> None:
        """Neither hear nor send until `connect`; the subscriptions are kept."""
        if self.connected:
            self.connected = False
            for cob_id, callback in self._mine.items():
                self._routes[cob_id].remove(callback)

    def add_subscription(self, cob_id: int, callback: Callable[[int, bytes], None]) -> None:
        """Call `callback` with every frame of this identifier."""
        self.remove_subscription(cob_id)
        self._mine[cob_id] = callback
        if self.connected:
            self._routes.setdefault(cob_id, []).append(callback)

    def remove_subscription(self, cob_id: int) -> None:
        """Stop listening to an identifier."""
        callback = self._mine.pop(cob_id, None)
        if callback is not None and self.connected:
            self._routes[cob_id].remove(callback)


class Node:
    """A node as durand's SDO server expects it (`node_id`, `network`, `object_dictionary`, `nmt`), and more.

    Args:
        node_id: 1 to 127.
        eds: the EDS file of the device.
        network: its side of the bus.
        timers: simulated time.
        make_application: builds the device profile on this node.
    """

    def __init__(
        self,
        node_id: int,
        eds: Path,
        network: NodeBus,
        timers: Timers,
        make_application: Callable[[Node], Application],
    ) -> None:
        self.node_id = node_id
        self.network = network
        self.timers = timers
        self.object_dictionary = Dictionary(eds, node_id)
        self.nmt = NmtSlave(node_id, self._initialise, self._send_boot_up)
        self.nmt.state_callbacks.add(self._nmt_changed)
        self.sdo_server = SdoServer(self)
        self.emergency = Emergency(self.object_dictionary, self._send_emergency)
        self.producer = HeartbeatProducer(self.object_dictionary, timers, self._send_heartbeat)
        self.consumer = HeartbeatConsumer(self.object_dictionary, timers, self._heartbeat_lost)
        self.rpdos = [self._make_rpdo(k) for k in range(_PDOS) if 0x1400 + k in self.object_dictionary]
        self.tpdos = [self._make_tpdo(k) for k in range(_PDOS) if 0x1800 + k in self.object_dictionary]
        self.senders = [EventSender(tpdo, timers, network.send) for tpdo in self.tpdos]
        self._sync_rpdos: list[Rpdo] = []
        self._sync_tpdos: list[Tpdo] = []
        self._subscribed: list[int] = []
        self.application = make_application(self)

    def power_on(self) -> None:
        """Boot: initialise, send the boot-up message, become pre-operational."""
        self.network.connect()
        self.nmt.reset(application=True)

    def power_off(self) -> None:
        """The supply fails: nothing is sent any more, the power stage is off."""
        self.network.disconnect()
        self.nmt.enter(NmtState.INITIALISATION)
        self.application.reset()

    def bus_off(self) -> None:
        """The CAN controller has counted 256 transmit errors (ISO 11898-1) and left the bus: a lost connection."""
        self.network.disconnect()
        self._connection_lost()

    def bus_on(self) -> None:
        """The CAN controller has recovered from bus-off."""
        self.network.connect()
        self.emergency.report(ErrorCode.BUS_OFF_RECOVERED, ErrorRegister.COMMUNICATION)

    def latch(self) -> None:
        """SYNC: apply the waiting RPDOs, then take the process values of this instant."""
        if self.nmt.state is NmtState.OPERATIONAL:
            for rpdo in self._sync_rpdos:
                rpdo.sync()
            self.application.sample()

    def sync_frames(self) -> list[tuple[int, bytes]]:
        """The TPDOs that go out with this SYNC."""
        return [(tpdo.can_id, tpdo.data()) for tpdo in self._sync_tpdos if tpdo.due_at_sync()]

    def notify_event(self) -> None:
        """Something worth an event-driven TPDO has happened."""
        if self.nmt.state is NmtState.OPERATIONAL:
            for sender in self.senders:
                sender.event()

    def _make_rpdo(self, k: int) -> Rpdo:
        return Rpdo(
            self.object_dictionary,
            PdoIndices(0x1400 + k, 0x1600 + k),
            self._pdo_changed,
            lambda: self.application.rpdo_applied(),
            self._report_length,
        )

    def _make_tpdo(self, k: int) -> Tpdo:
        return Tpdo(self.object_dictionary, PdoIndices(0x1800 + k, 0x1A00 + k), self._pdo_changed)

    def _initialise(self, application: bool) -> None:
        self.object_dictionary.restore(0x1000, 0xFFFF if application else 0x1FFF)
        self.sdo_server.reset()
        for pdo in (*self.rpdos, *self.tpdos):
            pdo.load()
        self.producer.reset()
        self.consumer.reset()
        if application:
            self.application.reset()

    def _nmt_changed(self, state: NmtState) -> None:
        for pdo in (*self.rpdos, *self.tpdos):
            pdo.stale = True
        # The application first: a TPDO that starts with the new state shows what the state made of it.
        self.application.nmt_changed(state)
        self._wire_pdos()

    def _pdo_changed(self) -> None:
        self._wire_pdos()

    def _wire_pdos(self) -> None:
        serving = self.nmt.state is NmtState.OPERATIONAL
        rpdos = [rpdo for rpdo in self.rpdos if serving and rpdo.valid]
        tpdos = [tpdo for tpdo in self.tpdos if serving and tpdo.valid]
        for pdo in (*rpdos, *tpdos):
            pdo.compile_if_stale()
        self._sync_rpdos = [rpdo for rpdo in rpdos if rpdo.synchronous]
        self._sync_tpdos = [tpdo for tpdo in tpdos if tpdo.synchronous]
        for sender in self.senders:
            sender.enable(sender.tpdo in tpdos and not sender.tpdo.synchronous)
        self._subscribe(rpdos)

    def _subscribe(self, rpdos: list[Rpdo]) -> None:
        for cob_id in self._subscribed:
            self.network.remove_subscription(cob_id)
        self._subscribed = [rpdo.can_id for rpdo in rpdos]
        for rpdo in rpdos:
            self.network.add_subscription(rpdo.can_id, rpdo.receive)

    def _report_length(self, too_long: bool) -> None:
        code = ErrorCode.PDO_TOO_LONG if too_long else ErrorCode.PDO_LENGTH
        self.emergency.report(code, ErrorRegister.COMMUNICATION)

    def _heartbeat_lost(self, _node_id: int) -> None:
        self.emergency.report(ErrorCode.HEARTBEAT, ErrorRegister.COMMUNICATION)
        self._connection_lost()

    def _connection_lost(self) -> None:
        self.application.connection_lost()
        target = _ERROR_BEHAVIOUR[self.object_dictionary.value(0x1029, 1)]
        if target is not None and self.nmt.state is NmtState.OPERATIONAL:
            self.nmt.enter(target)

    def _send_boot_up(self) -> None:
        self.network.send(0x700 + self.node_id, b"\x00")

    def _send_heartbeat(self) -> None:
        self.network.send(0x700 + self.node_id, bytes((self.nmt.state,)))

    def _send_emergency(self, cob_id: int, data: bytes) -> None:
        if self.nmt.state in (NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL):
            self.network.send(cob_id, data)

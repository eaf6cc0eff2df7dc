"""One CANopen node: the services of CiA 301 around an object dictionary, and the application behind it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from emulator.firmware.dictionary import Dictionary
from emulator.firmware.emergency import Emergency, ErrorCode
from emulator.firmware.guarding import NodeGuarding
from emulator.firmware.heartbeat import ERROR_CONTROL, HeartbeatConsumer, HeartbeatProducer
from emulator.firmware.nmt import NmtSlave, NmtState
from emulator.firmware.nodebus import NodeBus
from emulator.firmware.pdos import Pdos
from emulator.firmware.sdo import SdoServer
from emulator.firmware.storage import Memory, ParameterStorage
from emulator.firmware.sync import SyncService
from emulator.firmware.time_of_day import TimeOfDay
from emulator.firmware.timers import Timers

_ERROR_BEHAVIOUR = {0: NmtState.PRE_OPERATIONAL, 1: None, 2: NmtState.STOPPED}
"""1029h:1 -> the NMT state that a communication error leads to from operational (CiA 301, 7.5.2.32)."""

_TALKING = (NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL)
"""NMT states with SDO, EMCY, SYNC and TIME (CiA 301, table 38)."""


class Application(Protocol):
    """The device profile of a node: CiA 402 or CiA 406."""

    def reset(self) -> None:
        """Start afresh from the object dictionary."""

    def nmt_changed(self, state: NmtState) -> None:
        """The NMT state is another one now."""

    def rpdo_applied(self) -> None:
        """All values of an RPDO have been written."""

    def rpdo_missing(self) -> None:
        """An RPDO did not come within its event timer; 8250h has been reported."""

    def sample(self) -> None:
        """SYNC: take the process values of this instant."""

    def connection_lost(self) -> None:
        """The heartbeat of a node in 1016h, or the guarding of the master, is missing."""


class Node:
    """A node on a bus.

    Args:
        node_id: 1 to 127.
        eds: the EDS file of the device.
        bus: its CAN controller.
        timers: simulated time.
        memory: where stored parameters outlive it.
        stored_as: their name there.
        make_application: builds the device profile on this node.
        renumbered: asked with every reset by NMT; True where the device has become another node instead.

    Attributes:
        object_dictionary, nmt, sync, emergency, timers: services that device profiles use.
        pdos: its PDOs.
    """

    def __init__(
        self,
        node_id: int,
        eds: Path,
        bus: NodeBus,
        timers: Timers,
        memory: Memory,
        stored_as: str,
        make_application: Callable[[Node], Application],
        renumbered: Callable[[], bool],
    ) -> None:
        self.node_id = node_id
        self.network = bus
        self.timers = timers
        objects = self.object_dictionary = Dictionary(eds, node_id)
        self.nmt = NmtSlave(node_id, self._initialise, self._send_boot_up, self._nmt_changed, renumbered)
        self.emergency = Emergency(objects, timers, node_id, self._send_emergency)
        self.sync = SyncService(objects, timers, bus.listen_to_sync, bus.produce_sync)
        self._clock = TimeOfDay(objects, timers, bus)
        self._sdo = SdoServer(objects, timers, self._send_sdo)
        self._storage = ParameterStorage(objects, memory, stored_as, lambda: self.nmt.state is not NmtState.OPERATIONAL)
        self._producer = HeartbeatProducer(objects, timers, self._send_heartbeat)
        self._consumer = HeartbeatConsumer(objects, timers, bus, self._heartbeat_lost, self._heartbeat_found)
        self._guarding = NodeGuarding(objects, timers, self._send_guarding, self._guarding_lost, self._heartbeat_found)
        self.pdos = Pdos(self)
        self.application = make_application(self)
        bus.subscribe(0x000, self.nmt.receive)
        bus.subscribe(0x600 + node_id, self._take_sdo)
        bus.answer_remote(ERROR_CONTROL + node_id, self._answer_guarding)

    def power_on(self) -> None:
        """Boot: initialise, send the boot-up message, become pre-operational."""
        self.network.connect()
        self.nmt.reset(application=True)

    def power_off(self) -> None:
        """The supply fails: nothing is sent any more, the power stage is off."""
        self.network.disconnect()
        self.nmt.enter(NmtState.INITIALISATION)
        self._consumer.reset()
        self._guarding.reset()
        self.application.reset()

    def retire(self) -> None:
        """The device becomes another node: this one is off for good, and no timer of it is left."""
        self.power_off()
        self.object_dictionary.restore()
        self._producer.reset()
        self._consumer.reset()

    def bus_off(self) -> None:
        """The CAN controller has counted 256 transmit errors (ISO 11898-1) and left the bus: a lost connection."""
        self.network.disconnect()
        self._connection_lost()

    def bus_on(self) -> None:
        """The CAN controller has recovered from bus-off."""
        self.network.connect()
        self.emergency.report_communication(ErrorCode.BUS_OFF_RECOVERED)
        self.emergency.end_communication(ErrorCode.BUS_OFF_RECOVERED)

    def accepts_sync(self, data: bytes) -> bool:
        """Whether a SYNC is one that this node is configured for; one of another length is an error."""
        fits = self.sync.accepts(data)
        if fits:
            self.emergency.end_communication(ErrorCode.SYNC_LENGTH)
        elif self.nmt.state in _TALKING:
            self.emergency.report_communication(ErrorCode.SYNC_LENGTH, len(data))
        return fits

    def latch(self) -> None:
        """SYNC: apply the waiting RPDOs, then take the process values of this instant."""
        if self.nmt.state is NmtState.OPERATIONAL:
            for rpdo in self.pdos.sync_rpdos:
                rpdo.sync()
            self.application.sample()
            for tpdo in self.pdos.sampled_tpdos:
                tpdo.sample()

    def sync_frames(self) -> list[tuple[int, bytes, NodeBus]]:
        """The TPDOs that go out with this SYNC: identifier, data, and the controller that sends them."""
        counter, bus = self.sync.counter, self.network
        return [(tpdo.can_id, tpdo.data(), bus) for tpdo in self.pdos.sync_tpdos if tpdo.due_at_sync(counter)]

    def notify_event(self) -> None:
        """Something worth an event-driven TPDO has happened."""
        if self.nmt.state is NmtState.OPERATIONAL:
            self.pdos.event()

    def _initialise(self, application: bool) -> None:
        self.object_dictionary.restore(0x1000, 0xFFFF if application else 0x1FFF, self._storage.stored())
        self._sdo.reset()
        self.emergency.reset_communication()
        if application:
            self.emergency.reset()
        self.pdos.load()
        self.sync.reset()
        self._clock.reset()
        if application:
            self._clock.restart()
        self._producer.reset()
        self._consumer.reset()
        self._guarding.reset()
        if application:
            self.application.reset()

    def _nmt_changed(self, state: NmtState) -> None:
        # The application first: a TPDO that starts with the new state shows what the state made of it.
        self.application.nmt_changed(state)
        self.pdos.wire(state is NmtState.OPERATIONAL)
        self.sync.run(state in _TALKING)
        self._clock.run(state in _TALKING)
        if state not in _TALKING:
            self._sdo.reset()

    def _take_sdo(self, can_id: int, data: bytes) -> None:
        if self.nmt.state in _TALKING:
            self._sdo.receive(can_id, data)

    def _heartbeat_lost(self, node_id: int) -> None:
        if self.nmt.state is NmtState.INITIALISATION:
            # A node without supply misses nobody.
            return
        self.emergency.report_communication(ErrorCode.HEARTBEAT, node_id)
        self._connection_lost()

    def _heartbeat_found(self) -> None:
        self.emergency.end_communication(ErrorCode.HEARTBEAT)

    def _guarding_lost(self) -> None:
        self._heartbeat_lost(0)

    def _answer_guarding(self) -> None:
        self._guarding.request(self.nmt.state)

    def _connection_lost(self) -> None:
        self.application.connection_lost()
        target = _ERROR_BEHAVIOUR[self.object_dictionary.value(0x1029, 1, default=0)]
        if target is not None and self.nmt.state is NmtState.OPERATIONAL:
            self.nmt.enter(target)

    def _send_boot_up(self) -> None:
        self.network.send(ERROR_CONTROL + self.node_id, b"\x00")

    def _send_heartbeat(self) -> None:
        self.network.send(ERROR_CONTROL + self.node_id, bytes((self.nmt.state,)))

    def _send_guarding(self, value: int) -> None:
        self.network.send(ERROR_CONTROL + self.node_id, bytes((value,)))

    def _send_sdo(self, data: bytes) -> None:
        self.network.send(0x580 + self.node_id, data)

    def _send_emergency(self, cob_id: int, data: bytes) -> None:
        if self.nmt.state in _TALKING:
            self.network.send(cob_id, data)

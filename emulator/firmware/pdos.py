"""The PDOs of one node, wired to its bus as NMT state and parameters say."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from emulator.firmware.dictionary import Dictionary
from emulator.firmware.emergency import Emergency, ErrorCode
from emulator.firmware.event_pdo import EventSender
from emulator.firmware.nodebus import NodeBus
from emulator.firmware.pdo import PdoIndices
from emulator.firmware.rpdo import Rpdo, RpdoEvents
from emulator.firmware.sync import SyncService
from emulator.firmware.timers import Timers
from emulator.firmware.tpdo import SAMPLED_FOR_REMOTE, Tpdo

_MOST = 512
"""PDOs of one direction that an object dictionary has room for (CiA 301, table 35)."""


class PdoReactions(Protocol):
    """What the device profile does about RPDOs."""

    def rpdo_applied(self) -> None:
        """All values of an RPDO have been written."""

    def rpdo_missing(self) -> None:
        """An RPDO did not come within its event timer."""


class PdoNode(Protocol):
    """What the PDOs need of their node."""

    node_id: int
    network: NodeBus
    timers: Timers
    object_dictionary: Dictionary
    emergency: Emergency
    sync: SyncService

    @property
    def application(self) -> PdoReactions:
        """The device profile."""


class Pdos:
    """All PDOs of a node.

    Args:
        node: the node; its application may be set later.

    Attributes:
        sync_rpdos: to be applied with a SYNC.
        sync_tpdos: to be asked with a SYNC whether they are due.
        sampled_tpdos: to take their values with a SYNC, for a remote frame.
    """

    def __init__(self, node: PdoNode) -> None:
        self._node = node
        objects = node.object_dictionary
        self._rpdos = [self._make_rpdo(k) for k in range(_MOST) if 0x1400 + k in objects]
        self._tpdos = [self._make_tpdo(k) for k in range(_MOST) if 0x1800 + k in objects]
        self._senders = [EventSender(tpdo, node.timers, node.network.send) for tpdo in self._tpdos]
        self._operational = False
        self._heard: list[tuple[int, Callable[[int, bytes], None]]] = []
        self._answered: list[tuple[int, Callable[[], None]]] = []
        self._answers = {id(tpdo): self._make_answer(tpdo) for tpdo in self._tpdos}
        self.sync_rpdos: list[Rpdo] = []
        self.sync_tpdos: list[Tpdo] = []
        self.sampled_tpdos: list[Tpdo] = []

    def load(self) -> None:
        """Take everything from the object dictionary, as after a reset."""
        for pdo in (*self._rpdos, *self._tpdos):
            pdo.load()

    def event(self) -> None:
        """Something worth an event-driven TPDO has happened."""
        for sender in self._senders:
            sender.event()

    def wire(self, operational: bool) -> None:
        """Start afresh in a new NMT state."""
        self._operational = operational
        for pdo in (*self._rpdos, *self._tpdos):
            pdo.stale = True
        for rpdo in self._rpdos:
            rpdo.stop()
        self._wire()

    def _wire(self) -> None:
        rpdos = [rpdo for rpdo in self._rpdos if self._operational and rpdo.valid]
        tpdos = [tpdo for tpdo in self._tpdos if self._operational and tpdo.valid]
        for pdo in (*rpdos, *tpdos):
            pdo.compile_if_stale()
        self.sync_rpdos = [rpdo for rpdo in rpdos if rpdo.synchronous]
        self.sync_tpdos = [tpdo for tpdo in tpdos if tpdo.synchronous]
        self.sampled_tpdos = [tpdo for tpdo in tpdos if tpdo.transmission_type == SAMPLED_FOR_REMOTE]
        for sender in self._senders:
            sender.enable(sender.tpdo in tpdos and sender.tpdo.event_driven)
        self._subscribe(rpdos, [tpdo for tpdo in tpdos if tpdo.answers_remote])

    def _subscribe(self, rpdos: list[Rpdo], asked: list[Tpdo]) -> None:
        bus = self._node.network
        for can_id, receive in self._heard:
            bus.unsubscribe(can_id, receive)
        for can_id, answer in self._answered:
            bus.ignore_remote(can_id, answer)
        self._heard = [(rpdo.can_id, rpdo.receive) for rpdo in rpdos]
        self._answered = [(tpdo.can_id, self._answers[id(tpdo)]) for tpdo in asked]
        for can_id, receive in self._heard:
            bus.subscribe(can_id, receive)
        for can_id, answer in self._answered:
            bus.answer_remote(can_id, answer)

    def _make_answer(self, tpdo: Tpdo) -> Callable[[], None]:
        return lambda: self._node.network.send(tpdo.can_id, tpdo.remote_data())

    def _make_tpdo(self, k: int) -> Tpdo:
        return Tpdo(self._node.object_dictionary, PdoIndices(0x1800 + k, 0x1A00 + k), self._wire)

    def _make_rpdo(self, k: int) -> Rpdo:
        emergency = self._node.emergency

        def wrong_length(too_long: bool) -> None:
            emergency.report_communication(ErrorCode.PDO_TOO_LONG if too_long else ErrorCode.PDO_LENGTH, k + 1)

        def right_length() -> None:
            emergency.end_communication(ErrorCode.PDO_TOO_LONG, k + 1)
            emergency.end_communication(ErrorCode.PDO_LENGTH, k + 1)

        def missing() -> None:
            emergency.report_communication(ErrorCode.RPDO_TIMEOUT, k + 1)
            self._node.application.rpdo_missing()

        events = RpdoEvents(
            changed=self._wire,
            applied=lambda: self._node.application.rpdo_applied(),
            wrong_length=wrong_length,
            right_length=right_length,
            missing=missing,
            back=lambda: emergency.end_communication(ErrorCode.RPDO_TIMEOUT, k + 1),
        )
        indices = PdoIndices(0x1400 + k, 0x1600 + k)
        return Rpdo(self._node.object_dictionary, indices, self._node.timers, self._node.sync, events)

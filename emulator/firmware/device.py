"""A device on the bus: the node that it is at present, and the LSS slave that may make it another one."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Final

from emulator.firmware.dictionary import Dictionary
from emulator.firmware.lss import UNCONFIGURED, LssEvents, LssSettings, LssSlave
from emulator.firmware.node import Node
from emulator.firmware.nodebus import NodeBus
from emulator.firmware.storage import Memory

_SERIAL: Final = (0x1018, 4)
_STORED_AS: Final = "LSS"
_NODE_ID, _BIT_RATE = (0, 0), (0, 1)
"""Keys of the stored settings."""


class Device:
    """One device: its identity is that of its place in the network file, its node-ID is what LSS says.

    A node-ID is taken with the next reset of the node or its communication; for that the device boots anew.

    Args:
        place: its node-ID in the network file.
        eds: its EDS file.
        bus: the CAN controller of its LSS.
        memory: where LSS stores.
        make_node: makes the node of a node-ID; the function that it is given says whether a reset is taken from it.
        replaced: called with each node that it becomes.

    Attributes:
        node: what it is at present; off the bus while the device has no node-ID.
    """

    def __init__(
        self,
        place: int,
        eds: Path,
        bus: NodeBus,
        memory: Memory,
        make_node: Callable[[int, Callable[[], bool]], Node],
        replaced: Callable[[Node], None],
    ) -> None:
        self._place = place
        self._bus = bus
        self._memory = memory
        self._make_node = make_node
        self._replaced = replaced
        objects = Dictionary(eds, place)
        vendor, product, revision, serial = (objects.value(0x1018, k, default=0) for k in range(1, 5))
        self._serial = serial
        events = LssEvents(self._store, self._take_first_node_id)
        self._lss = LssSlave((vendor, product, revision, serial), self._stored(), bus, events)
        self.node = self._new_node()

    def power_on(self) -> None:
        """Boot with the stored settings."""
        stored = self._stored()
        changed = stored.node_id != self._lss.active
        self._lss.restart(stored)
        self._bus.connect()
        if changed:
            self._become_another()
        elif self._lss.active != UNCONFIGURED:
            self.node.power_on()

    def power_off(self) -> None:
        """The supply fails."""
        self._bus.disconnect()
        self.node.power_off()

    def bus_off(self) -> None:
        """The CAN controller has left the bus."""
        self._bus.disconnect()
        self.node.bus_off()

    def bus_on(self) -> None:
        """The CAN controller is back."""
        self._bus.connect()
        if self._lss.active != UNCONFIGURED:
            self.node.bus_on()

    def _new_node(self) -> Node:
        named = self._lss.active if self._lss.active != UNCONFIGURED else self._place
        node = self._make_node(named, self._renumbered)
        if named != self._place and _SERIAL[0] in node.object_dictionary:
            # The serial number of the EDS is made of the node-ID, but a device keeps its own.
            node.object_dictionary.on_read(*_SERIAL, lambda: self._serial)
        if self._lss.active == UNCONFIGURED:
            node.network.disconnect()
        return node

    def _renumbered(self) -> bool:
        """A reset has come: whether the device becomes another node by it."""
        if self._lss.pending.node_id == self._lss.active:
            return False
        self._lss.active = self._lss.pending.node_id
        self._become_another()
        return True

    def _take_first_node_id(self) -> None:
        if self._lss.active == UNCONFIGURED:
            self._renumbered()

    def _become_another(self) -> None:
        self.node.retire()
        self.node = self._new_node()
        self._replaced(self.node)
        if self._lss.active != UNCONFIGURED:
            self.node.power_on()

    def _stored(self) -> LssSettings:
        values = self._memory.load(self._name, _STORED_AS)
        return LssSettings(int(values.get(_NODE_ID, self._place)), int(values.get(_BIT_RATE, 0)))

    def _store(self, settings: LssSettings) -> None:
        self._memory.save(self._name, _STORED_AS, {_NODE_ID: settings.node_id, _BIT_RATE: settings.bit_rate})

    @property
    def _name(self) -> str:
        return f"lss_{self._place}"

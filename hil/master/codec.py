"""PDO bytes to SI quantities of the vehicle and back; everything that can be is worked out beforehand."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import NamedTuple

import can

from hil.network import MappedObject, Network, Node, Pdo, PdoDirection
from hil.network.cia import Index


class FieldRef(NamedTuple):
    """Where an object is: number of the TPDO among all of a cycle, number of the field in it."""

    slot: int
    field: int


class CycleLayout:
    """All TPDOs of one cycle: identifier -> slot, and where each object of each node is.

    Args:
        network: the network file.
    """

    def __init__(self, network: Network) -> None:
        self.slots: dict[int, int] = {}
        self.structs: list[struct.Struct] = []
        self.owners: list[Node] = []
        self._fields: dict[tuple[int, int], FieldRef] = {}
        for node in network.nodes:
            for pdo in node.pdos:
                if pdo.direction is PdoDirection.TRANSMIT:
                    self._add(node, pdo)

    def field(self, node: Node, index: int) -> FieldRef:
        """Where object `index` of `node` is."""
        return self._fields[node.node_id, index]

    def _add(self, node: Node, pdo: Pdo) -> None:
        slot = len(self.structs)
        self.slots[pdo.cob_id(node.node_id)] = slot
        self.structs.append(struct.Struct(pdo.struct_format))
        self.owners.append(node)
        for position, item in enumerate(pdo.objects):
            self._fields[node.node_id, item.index] = FieldRef(slot, position)


class CommandFrames:
    """The RPDOs of one drive, whose two fields are overwritten in place every cycle.

    Args:
        node: the drive.
    """

    def __init__(self, node: Node) -> None:
        receive = [pdo for pdo in node.pdos if pdo.direction is PdoDirection.RECEIVE]
        self.messages = [_message(pdo, node.node_id) for pdo in receive]
        self._places: Mapping[int, tuple[struct.Struct, int, can.Message]] = {
            item.index: (struct.Struct("<" + item.code), offset, message)
            for pdo, message in zip(receive, self.messages, strict=True)
            for item, offset in _offsets(pdo)
        }
        self._torque = self._places[Index.TARGET_TORQUE]
        self._control = self._places[Index.CONTROLWORD]
        self._permille = 1.0 / node.torque_unit
        self.target = 0

    def set_torque(self, torque: float) -> None:
        """Motor torque [Nm], vehicle sign; rounded to one per mille of rated, saturated at the field's range."""
        target = round(torque * self._permille)
        self.target = 32767 if target > 32767 else -32768 if target < -32768 else target
        field, offset, message = self._torque
        field.pack_into(message.data, offset, self.target)

    def set_controlword(self, controlword: int) -> None:
        """Controlword 6040h."""
        field, offset, message = self._control
        field.pack_into(message.data, offset, controlword)


def _message(pdo: Pdo, node_id: int) -> can.Message:
    size = struct.calcsize(pdo.struct_format)
    return can.Message(arbitration_id=pdo.cob_id(node_id), is_extended_id=False, is_rx=False, data=bytearray(size))


def _offsets(pdo: Pdo) -> list[tuple[MappedObject, int]]:
    offsets, offset = [], 0
    for item in pdo.objects:
        offsets.append((item, offset))
        offset += item.bits // 8
    return offsets


class Counter:
    """A wrapping counter made a continuous angle.

    Args:
        node: gives modulus, zero and the angle of one count.
    """

    def __init__(self, node: Node) -> None:
        self._modulus = node.counter_modulus
        self._half = self._modulus // 2
        self._last = node.zero_counts
        self._total = 0
        self._unit = node.angle_unit

    def angle(self, counts: int) -> float:
        """Angle [rad], vehicle sign, of the present count; it moves by less than half the range between calls."""
        step = (counts - self._last + self._half) % self._modulus - self._half
        self._last = counts
        self._total += step
        return self._total * self._unit

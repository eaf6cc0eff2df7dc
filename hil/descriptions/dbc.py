"""A DBC file of the network: all frames by name, PDOs in SI units and vehicle signs."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import ModuleType
from typing import Any, Final

from hil.network import MappedObject, Network, Node, Pdo, PdoDirection
from hil.network.cia import Index, NmtState, Service
from ident.errors import UserError

_MASTER: Final = "master"

_NMT_STATES: Final = {int(state): state.name.lower() for state in NmtState}
_NMT_COMMANDS: Final = {
    1: "start",
    2: "stop",
    128: "enter_pre_operational",
    129: "reset_node",
    130: "reset_communication",
}


@dataclass(frozen=True)
class _Unit:
    """Physical value = factor * raw + offset, in a unit."""

    factor: float = 1.0
    offset: float = 0.0
    name: str = ""


def _torque(node: Node) -> _Unit:
    return _Unit(node.torque_unit, 0.0, "Nm")


def _angle(node: Node) -> _Unit:
    return _Unit(node.angle_unit, -node.angle_unit * node.zero_counts, "rad")


def _rate(node: Node) -> _Unit:
    return _Unit(node.angle_unit, 0.0, "rad/s")


_UNITS: Final[Mapping[int, Callable[[Node], _Unit]]] = {
    Index.ENCODER_POSITION: _angle,
    Index.POSITION_ACTUAL: _angle,
    Index.VELOCITY_ACTUAL: _rate,
    Index.TARGET_TORQUE: _torque,
    Index.TORQUE_DEMAND: _torque,
    Index.TORQUE_ACTUAL: _torque,
    Index.TORQUE_OFFSET: _torque,
    Index.TARGET_VELOCITY: _rate,
}
"""Object -> its unit on the vehicle: motor shaft torque, wheel or steering angle and rate; others are left raw."""


def write_dbc(network: Network) -> str:
    """The DBC of a network.

    Raises:
        UserError: cantools is not installed.
    """
    try:
        import cantools.database
        import cantools.database.conversion
    except ImportError as error:
        raise UserError("cantools is not installed.", "Install it: pip install 'quasiomni[dbc]'.") from error
    can_database = cantools.database.can
    builder = _Builder(can_database, cantools.database.conversion, network)
    database = can_database.Database(
        messages=builder.messages(),
        nodes=[can_database.Node(name, None) for name in (_MASTER, *(str(node.role) for node in network.nodes))],
        version=network.name,
    )
    text: str = database.as_dbc_string()
    return text


class _Builder:
    def __init__(self, can_database: ModuleType, conversion: ModuleType, network: Network) -> None:
        self._can = can_database
        self._conversion = conversion
        self._network = network

    def messages(self) -> list[Any]:
        network = self._network
        command = [self._raw("Command", 0, 8, choices=_NMT_COMMANDS), self._raw("Node_id", 8, 8)]
        messages = [
            self._message(Service.NMT, "NMT", 2, command, _MASTER, "NMT command; node id 0 means all nodes"),
            self._message(network.sync_cob_id, "SYNC", 0, [], _MASTER, "SYNC", network.cycle_period),
        ]
        messages.append(self._heartbeat(Service.HEARTBEAT + network.master_id, _MASTER))
        for node in network.nodes:
            messages += [self._pdo(node, pdo) for pdo in node.pdos]
            messages += self._services(node)
        return messages

    def _services(self, node: Node) -> list[Any]:
        role, node_id = str(node.role), node.node_id
        emergency = [
            self._raw("Error_code", 0, 16),
            self._raw("Error_register", 16, 8),
            self._raw("Information", 24, 40),
        ]
        return [
            self._message(
                Service.EMERGENCY + node_id, f"{role}_EMCY", 8, emergency, role, "Emergency (CiA 301, CiA 402)"
            ),
            self._message(
                Service.SDO_REQUEST + node_id, f"{role}_SDO_request", 8, self._sdo(), _MASTER, "SDO, client to server"
            ),
            self._message(
                Service.SDO_ANSWER + node_id, f"{role}_SDO_answer", 8, self._sdo(), role, "SDO, server to client"
            ),
            self._heartbeat(Service.HEARTBEAT + node_id, role),
        ]

    def _sdo(self) -> list[Any]:
        fields = (("Command_specifier", 0, 8), ("Object_index", 8, 16), ("Object_subindex", 24, 8), ("Data", 32, 32))
        return [self._raw(name, start, length) for name, start, length in fields]

    def _heartbeat(self, can_id: int, sender: str) -> Any:
        signals = [self._raw("NMT_state", 0, 7, choices=_NMT_STATES), self._raw("Toggle", 7, 1)]
        return self._message(can_id, f"{sender}_heartbeat", 1, signals, sender, "Heartbeat, boot-up, node guarding")

    def _pdo(self, node: Node, pdo: Pdo) -> Any:
        received = pdo.direction is PdoDirection.RECEIVE
        signals, start = [], 0
        for item in pdo.objects:
            signals.append(self._signal(node, item, start))
            start += item.bits
        listed = ", ".join(f"{item.index:04X}h:{item.subindex}" for item in pdo.objects)
        return self._message(
            pdo.cob_id(node.node_id),
            f"{node.role}_{'R' if received else 'T'}PDO{pdo.number}",
            start // 8,
            signals,
            _MASTER if received else str(node.role),
            f"Objects {listed}",
            self._network.cycle_period * max(pdo.transmission_type, 1),
        )

    def _signal(self, node: Node, item: MappedObject, start: int) -> Any:
        unit = _UNITS[item.index](node) if item.index in _UNITS else _Unit()
        return self._can.Signal(
            re.sub(r"\W+", "_", item.name),
            start,
            item.bits,
            is_signed=item.code.islower(),
            unit=unit.name or None,
            conversion=self._conversion.BaseConversion.factory(unit.factor, unit.offset),
        )

    def _raw(self, name: str, start: int, length: int, choices: Mapping[int, str] | None = None) -> Any:
        return self._can.Signal(
            name, start, length, conversion=self._conversion.BaseConversion.factory(choices=choices and dict(choices))
        )

    def _message(
        self, can_id: int, name: str, length: int, signals: list[Any], sender: str, comment: str, period: float = 0.0
    ) -> Any:
        return self._can.Message(
            can_id,
            name,
            length,
            signals,
            comment=comment,
            senders=[sender],
            cycle_time=round(period * 1000.0) or None,
            is_extended_frame=False,
        )

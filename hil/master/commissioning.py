"""Bringing the nodes up: boot-up, identity, units, modes, PDO and heartbeat configuration (all by SDO)."""

from __future__ import annotations

import math
from collections.abc import Iterable

from hil.master.errors import IdentityError, MissingNodeError, ModeError, UnitsError
from hil.master.link import Link
from hil.master.sdo import ObjectAccess
from hil.network import Network, Node, Pdo
from hil.network.cia import CobId, Index, Mode, NmtCommand, Service

_IDENTITY_OBJECTS = {
    "device_type": (Index.DEVICE_TYPE, 0),
    "vendor_id": (Index.IDENTITY, 1),
    "product_code": (Index.IDENTITY, 2),
    "revision_number": (Index.IDENTITY, 3),
}


def await_boot_up(link: Link, nodes: Iterable[Node], timeout: float) -> None:
    """Reset each node and wait until all have sent their boot-up message.

    Raises:
        MissingNodeError: some did not within `timeout` seconds; names all of them.
    """
    waiting = {node.node_id: node for node in nodes}

    def booted(can_id: int, data: bytearray, _timestamp: float) -> None:
        if bytes(data) == b"\x00":
            waiting.pop(can_id - Service.HEARTBEAT, None)

    # What has been waiting in the interface may hold the boot-up message of an earlier start.
    link.drain()
    heartbeats = [Service.HEARTBEAT + node_id for node_id in waiting]
    for can_id in heartbeats:
        link.subscribe(can_id, booted)
    try:
        for node_id in tuple(waiting):
            link.send_message(0, bytes((NmtCommand.RESET_NODE, node_id)))
        link.pump(timeout, lambda: not waiting)
    finally:
        for can_id in heartbeats:
            link.unsubscribe(can_id, booted)
    if waiting:
        raise MissingNodeError(
            f"{', '.join(node.label for node in waiting.values())} did not boot within {timeout:g} s.",
            "Check supply, cable, bit rate and node id, or correct the network file.",
        )


def check_identity(access: ObjectAccess) -> None:
    """Compare 1000h and 1018h with the network file.

    Raises:
        IdentityError: another device answers.
    """
    for name, (index, subindex) in _IDENTITY_OBJECTS.items():
        expected, found = getattr(access.node.identity, name), access.read(index, subindex)
        if found != expected:
            raise IdentityError(
                f"{access.node.label} has {name} {found:#x} ({index:04X}h:{subindex}), expected {expected:#x}.",
                "Connect the right device, or correct the identity in the network file.",
            )


def check_drive(access: ObjectAccess) -> None:
    """Compare rated torque and encoder resolution with the network file, and ask for the mode.

    Raises:
        UnitsError: 6076h or 608Fh differ.
        ModeError: cyclic synchronous torque is not in 6502h.
    """
    rated = access.node.quantity("rated_torque") * 1000.0
    _compare(access, "rated torque in mNm", Index.MOTOR_RATED_TORQUE, rated)
    counts = access.node.quantities["counts_per_revolution"].value
    increments = access.read(Index.ENCODER_RESOLUTION, 1) / max(access.read(Index.ENCODER_RESOLUTION, 2), 1)
    if increments != counts:
        raise _units(access.node, "counts per revolution", Index.ENCODER_RESOLUTION, increments, counts)
    if not access.read(Index.SUPPORTED_DRIVE_MODES) & Mode.CYCLIC_SYNCHRONOUS_TORQUE.supported_bit:
        raise ModeError(
            f"{access.node.label} does not support cyclic synchronous torque (6502h bit 9 is 0).",
            "Update its firmware or use a drive that does.",
        )


def check_encoder(access: ObjectAccess) -> None:
    """Compare measuring units and range with the network file.

    Raises:
        UnitsError: 6001h or 6002h differ.
    """
    counts, span = (access.node.quantities[name].value for name in ("counts_per_revolution", "measuring_range"))
    _compare(access, "measuring units per revolution", Index.MEASURING_UNITS_PER_REVOLUTION, counts)
    _compare(access, "measuring range", Index.TOTAL_MEASURING_RANGE, span)


def configure(access: ObjectAccess, network: Network) -> None:
    """Name the SYNC, map the PDOs, set SYNC transmission, and arm heartbeats in both directions."""
    _name_sync(access, network.sync_cob_id)
    for pdo in access.node.pdos:
        _configure_pdo(access, pdo)
    quantities = access.node.quantities
    timeout = round(quantities["heartbeat_timeout"].value * 1000.0)
    access.write(Index.CONSUMER_HEARTBEAT_TIME, 1, network.master_id << 16 | timeout)
    access.write(Index.PRODUCER_HEARTBEAT_TIME, 0, round(quantities["heartbeat_period"].value * 1000.0))


def select_mode(access: ObjectAccess) -> None:
    """Ask for cyclic synchronous torque and read it back.

    Raises:
        ModeError: 6061h shows another mode.
    """
    access.write(Index.MODES_OF_OPERATION, 0, Mode.CYCLIC_SYNCHRONOUS_TORQUE)
    mode = access.read(Index.MODES_OF_OPERATION_DISPLAY)
    if mode != Mode.CYCLIC_SYNCHRONOUS_TORQUE:
        raise ModeError(
            f"{access.node.label} stays in mode {mode} (6061h) instead of {Mode.CYCLIC_SYNCHRONOUS_TORQUE}.",
            "Look into the drive's manual for what keeps it there.",
        )


def _name_sync(access: ObjectAccess, cob_id: int) -> None:
    described = access.node.object_dictionary.get_variable(Index.SYNC_COB_ID)
    if described is not None and described.default != cob_id:
        access.write(Index.SYNC_COB_ID, 0, cob_id)


def _configure_pdo(access: ObjectAccess, pdo: Pdo) -> None:
    # CiA 301, 7.5.2.36: make it invalid, clear the count, map, set the count, make it valid.
    flags = access.read(pdo.communication_index, 1) & (CobId.NO_REMOTE | CobId.EXTENDED)
    cob_id = flags | pdo.cob_id(access.node.node_id)
    access.write(pdo.communication_index, 1, cob_id | CobId.INVALID)
    access.write(pdo.communication_index, 2, pdo.transmission_type)
    access.write(pdo.mapping_index, 0, 0)
    for subindex, item in enumerate(pdo.objects, start=1):
        access.write(pdo.mapping_index, subindex, item.mapping_entry)
    access.write(pdo.mapping_index, 0, len(pdo.objects))
    access.write(pdo.communication_index, 1, cob_id)


def _compare(access: ObjectAccess, what: str, index: int, expected: float) -> None:
    found = access.read(index)
    if not math.isclose(found, expected, rel_tol=1e-9, abs_tol=0.5):
        raise _units(access.node, what, index, found, expected)


def _units(node: Node, what: str, index: int, found: float, expected: float) -> UnitsError:
    return UnitsError(
        f"{node.label} has {what} {found:g} ({index:04X}h), the network file says {expected:g}.",
        "Correct the network file, or set the device to these units.",
    )

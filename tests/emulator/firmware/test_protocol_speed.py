"""Cycles a second of the nodes alone: SYNC, 4 RPDOs and 8 TPDOs a cycle, against bare durand slaves in the same run."""

from __future__ import annotations

import struct
import time
from collections.abc import Callable

import pytest
from durand.datatypes import DatatypeEnum
from durand.node import MinimalNode
from durand.object_dictionary import ObjectDictionary, Variable

pytestmark = pytest.mark.bench

CYCLES, ROUNDS = 2000, 7
DRIVES = (1, 2, 3, 4)
FRAMES = [struct.pack("<Hh", 0x0F, torque) for torque in range(50)]
LEAST = 12_000
"""Cycles a second that are a fair mark."""


def map_pdo(wire, node_id: int, communication: int, cob_id: int, objects: tuple[int, ...]) -> None:
    """A PDO with every SYNC, by the procedure of CiA 301."""
    steps = [(communication, 1, struct.pack("<I", 1 << 31 | cob_id)), (communication, 2, b"\x01")]
    steps += [(communication + 0x200, 0, b"\x00")]
    steps += [(communication + 0x200, k, struct.pack("<I", entry)) for k, entry in enumerate(objects, start=1)]
    steps += [(communication + 0x200, 0, bytes((len(objects),))), (communication, 1, struct.pack("<I", cob_id))]
    for index, subindex, data in steps:
        assert wire.write(node_id, index, subindex, data) == 0


def our_cycle(wire) -> Callable[[int], int]:
    """Drives that run in torque mode, with heartbeats both ways, watched RPDOs, and an SDO now and then."""
    for node_id in DRIVES:
        map_pdo(wire, node_id, 0x1400, 0x200 + node_id, (0x60400010, 0x60710010))
        map_pdo(wire, node_id, 0x1800, 0x180 + node_id, (0x60410010, 0x60770010, 0x60640020))
        map_pdo(wire, node_id, 0x1801, 0x280 + node_id, (0x606C0020, 0x60780010))
        wire.write(node_id, 0x1400, 5, struct.pack("<H", 50))
        wire.write(node_id, 0x1016, 1, struct.pack("<I", 0x7F0000 | 250))
        wire.write(node_id, 0x1017, 0, struct.pack("<H", 100))
        wire.enable(node_id)
    devices, sent = wire.devices, wire.sent

    def cycle(number: int) -> int:
        frame = FRAMES[number % 50]
        for node_id in DRIVES:
            devices.receive(0x200 + node_id, frame)
        devices.advance(round(devices.time + 0.002, 9))
        if number % 50 == 0:
            devices.receive(0x77F, b"\x05")
            devices.receive(0x601, b"\x40\x41\x60\x00\x00\x00\x00\x00")
        sent.clear()
        devices.receive(0x080, b"")
        return len(sent)

    return cycle


class DurandBus:
    """What durand wants of a bus, and nothing else."""

    def __init__(self) -> None:
        self.handlers: dict[int, Callable[[int, bytes], None]] = {}
        self.sent: list[tuple[int, bytes]] = []

    def add_subscription(self, cob_id: int, callback: Callable[[int, bytes], None]) -> None:
        self.handlers[cob_id] = callback

    def remove_subscription(self, cob_id: int, callback: object = None) -> None:
        self.handlers.pop(cob_id, None)

    def send(self, cob_id: int, msg: bytes) -> None:
        self.sent.append((cob_id, msg))


PLAIN_OBJECTS = {
    0x6040: DatatypeEnum.UNSIGNED16,
    0x6071: DatatypeEnum.INTEGER16,
    0x6041: DatatypeEnum.UNSIGNED16,
    0x6077: DatatypeEnum.INTEGER16,
    0x6064: DatatypeEnum.INTEGER32,
    0x606C: DatatypeEnum.INTEGER32,
    0x6078: DatatypeEnum.INTEGER16,
}

MEASURED = (0x6041, 0x6077, 0x6064, 0x606C, 0x6078)
"""What a drive has to bring up to date before it sends its TPDOs."""


def durand_slave(node_id: int) -> tuple[DurandBus, ObjectDictionary]:
    bus, objects = DurandBus(), ObjectDictionary()
    for index, datatype in PLAIN_OBJECTS.items():
        objects[index] = Variable(datatype, "rw", value=0)
    node = MinimalNode(bus, node_id, objects)
    node.rpdo[0].mapping = ((0x6040, 0), (0x6071, 0))
    node.tpdo[0].mapping = ((0x6041, 0), (0x6077, 0), (0x6064, 0))
    node.tpdo[1].mapping = ((0x606C, 0), (0x6078, 0))
    for pdo in (node.rpdo[0], node.tpdo[0], node.tpdo[1]):
        pdo.transmission_type = 1
    bus.handlers[0](0, bytes((0x01, node_id)))
    return bus, objects


def durand_cycle(live: bool) -> Callable[[int], int]:
    """The same PDOs on durand's nodes, without application and timers.

    Live values change with every cycle, as ours do; others stand still, and durand sends what it has packed before.
    """
    slaves = [durand_slave(node_id) for node_id in DRIVES]
    buses, dictionaries = [bus for bus, _ in slaves], [objects for _, objects in slaves]

    def cycle(number: int) -> int:
        frame = FRAMES[number % 50]
        for node_id, bus in zip(DRIVES, buses, strict=True):
            bus.handlers[0x200 + node_id](0x200 + node_id, frame)
            bus.sent.clear()
        for objects in dictionaries if live else ():
            for index in MEASURED:
                objects.write(index, 0, number)
        for bus in buses:
            bus.handlers[0x080](0x080, b"")
        return sum(len(bus.sent) for bus in buses)

    return cycle


def rate(cycle: Callable[[int], int]) -> float:
    """Cycles a second of CPU time; every one of them has to bring all TPDOs."""
    start = time.process_time()
    for number in range(CYCLES):
        assert cycle(number) == 8
    return CYCLES / (time.process_time() - start)


def test_the_nodes_with_all_services_on_are_faster_than_bare_durand_slaves(
    wire, capsys: pytest.CaptureFixture[str]
) -> None:
    cycles = (our_cycle(wire), durand_cycle(live=True), durand_cycle(live=False))
    rates = [[rate(cycle) for cycle in cycles] for _ in range(ROUNDS)]
    best, reference, constant = (max(column) for column in zip(*rates, strict=True))
    with capsys.disabled():
        print(
            f"\nprotocol alone: {best / 1e3:.1f} k cycles/s, bare durand slaves {reference / 1e3:.1f} k cycles/s "
            f"({constant / 1e3:.1f} k where their values never change)"
        )
    assert best > LEAST
    assert best > reference

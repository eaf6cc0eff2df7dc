"""Every object of every device, taken from its EDS: read, write, wrong length, out of range, wrong state."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

import canopen
import pytest
from canopen.objectdictionary import ODVariable
from canopen.objectdictionary.datatypes import INTEGER_TYPES

DATA = Path(__file__).parents[3] / "hil" / "data"
DEVICES = {1: "drive.eds", 5: "encoder.eds"}
SIZES = {2: 1, 3: 2, 4: 4, 5: 1, 6: 2, 7: 4}
"""Data type of CiA 301 -> bytes."""

READ_ONLY, TOO_LONG, TOO_SHORT = 0x06010002, 0x06070012, 0x06070013
TOO_HIGH, TOO_LOW = 0x06090031, 0x06090032


@dataclass(frozen=True)
class Entry:
    node_id: int
    variable: ODVariable

    @property
    def key(self) -> tuple[int, int]:
        return self.variable.index, self.variable.subindex

    @property
    def writable(self) -> bool:
        return self.variable.access_type in ("rw", "wo", "rww", "rwr")

    @property
    def size(self) -> int:
        return SIZES[self.variable.data_type]

    @property
    def type_range(self) -> tuple[int, int]:
        bits = 8 * self.size
        signed = self.variable.data_type in (2, 3, 4)
        return (-(1 << bits - 1), (1 << bits - 1) - 1) if signed else (0, (1 << bits) - 1)

    def pack(self, value: int) -> bytes:
        return value.to_bytes(self.size, "little", signed=value < 0)

    def __str__(self) -> str:
        return f"{DEVICES[self.node_id]}-{self.variable.index:04X}h-{self.variable.subindex}"


def entries() -> list[Entry]:
    found = []
    for node_id, name in DEVICES.items():
        for item in canopen.import_od(str(DATA / name), node_id).values():
            if item.index >= 0x20:
                variables = [item] if isinstance(item, ODVariable) else item.subindices.values()
                found += [Entry(node_id, variable) for variable in variables]
    return found


ALL = entries()
NUMBERS = [entry for entry in ALL if entry.variable.data_type in INTEGER_TYPES]
WRITABLE = [entry for entry in NUMBERS if entry.writable]
LIMITED = [
    entry
    for entry in WRITABLE
    if (entry.variable.min is not None and entry.variable.min > entry.type_range[0])
    or (entry.variable.max is not None and entry.variable.max < entry.type_range[1])
]


@pytest.fixture(scope="module")
def shared_wire(wire_type):
    return wire_type()


@pytest.fixture
def wire(shared_wire):
    """The same nodes for all tests, reset before each: making them takes longer than the tests."""
    shared_wire.nmt(0x81)
    return shared_wire


each_device = pytest.mark.parametrize("node_id", DEVICES, ids=DEVICES.values())
each_writable = pytest.mark.parametrize("entry", WRITABLE, ids=str)


def of_device(listed: list[Entry], node_id: int) -> list[Entry]:
    return [entry for entry in listed if entry.node_id == node_id]


def is_history(entry: Entry) -> bool:
    return entry.variable.index == 0x1003 and entry.variable.subindex > 0


def upload(wire, entry: Entry) -> bytes:
    frame = struct.pack("<BHB4x", 0x40, *entry.key)
    ((_, answer),) = wire.send(0x600 + entry.node_id, frame)
    assert answer[0] & 0xF3 == 0x43, answer.hex()
    return answer[4 : 8 - (answer[0] >> 2 & 3)]


def test_the_tables_are_not_empty() -> None:
    assert len(ALL) > 300
    assert {entry.node_id for entry in LIMITED} == set(DEVICES)


@each_device
def test_reading_gives_the_length_of_the_data_type(wire, node_id: int) -> None:
    for entry in of_device(NUMBERS, node_id):
        if is_history(entry):
            assert wire.abort_code_of_read(node_id, *entry.key) == 0x08000024
        else:
            assert len(upload(wire, entry)) == entry.size, str(entry)


@pytest.mark.parametrize("entry", [entry for entry in ALL if entry not in NUMBERS], ids=str)
def test_texts_and_domains_can_be_read(wire, entry: Entry) -> None:
    ((_, answer),) = wire.send(0x600 + entry.node_id, struct.pack("<BHB4x", 0x40, *entry.key))
    assert answer[0] >> 5 == 2
    assert struct.unpack_from("<HB", answer, 1) == entry.key


@each_device
def test_what_is_read_only_cannot_be_written(wire, node_id: int) -> None:
    for entry in of_device(NUMBERS, node_id):
        if not entry.writable:
            assert wire.write(node_id, *entry.key, bytes(entry.size)) == READ_ONLY, str(entry)


@each_device
def test_the_next_sub_index_is_not_there_unless_the_eds_has_it(wire, node_id: int) -> None:
    known = {entry.key for entry in of_device(ALL, node_id)}
    for index, subindex in sorted(known):
        for other in (subindex + 1, 0xFE):
            if (index, other) not in known:
                assert wire.abort_code_of_read(node_id, index, other) == 0x06090011


def refusal_while_running(entry: Entry) -> int:
    """What writing back the present value of an object is answered with, just after a reset."""
    index, subindex = entry.key
    if index in (0x1010, 0x1011):
        return 0x08000020
    valid = {0x1600, 0x1601, 0x1602, 0x1603, 0x1A00, 0x1A01, 0x1A02, 0x1A03}
    if index in valid:
        communication = index - 0x200
        node = canopen.import_od(str(DATA / DEVICES[entry.node_id]), entry.node_id)
        exists = not node[communication][1].default & 1 << 31
        count = node[index][0].default
        return 0x06010000 if exists or (subindex > 0 and count) else 0
    if 0x1800 <= index < 0x1A00 and subindex in (3, 6):
        node = canopen.import_od(str(DATA / DEVICES[entry.node_id]), entry.node_id)
        return 0 if node[index][1].default & 1 << 31 else 0x08000022
    return 0


@each_writable
def test_what_was_read_can_be_written_back(wire, entry: Entry) -> None:
    data = upload(wire, entry)
    assert wire.write(entry.node_id, *entry.key, data) == refusal_while_running(entry)
    assert upload(wire, entry) == data


@each_writable
def test_values_of_the_wrong_length_are_refused(wire, entry: Entry) -> None:
    data = upload(wire, entry)
    if entry.size < 4:
        assert wire.write(entry.node_id, *entry.key, data + b"\x00") == TOO_LONG
    if entry.size > 1:
        assert wire.write(entry.node_id, *entry.key, data[:-1]) == TOO_SHORT
    assert upload(wire, entry) == data


@pytest.mark.parametrize("entry", LIMITED, ids=str)
def test_values_out_of_range_are_refused(wire, entry: Entry) -> None:
    low, high = entry.type_range
    data = upload(wire, entry)
    if entry.variable.max is not None and entry.variable.max < high:
        assert wire.write(entry.node_id, *entry.key, entry.pack(entry.variable.max + 1)) == TOO_HIGH
        assert wire.write(entry.node_id, *entry.key, entry.pack(high)) == TOO_HIGH
    if entry.variable.min is not None and entry.variable.min > low:
        assert wire.write(entry.node_id, *entry.key, entry.pack(entry.variable.min - 1)) == TOO_LOW
        assert wire.write(entry.node_id, *entry.key, entry.pack(low)) == TOO_LOW
    assert upload(wire, entry) == data


MEASURED = {0x6004, 0x6030, 0x6041, 0x6062, 0x6064, 0x606B, 0x606C, 0x6074, 0x6077, 0x6078, 0x6079, 0x60F4, 0x6509}
"""Objects that show what the device does: their default in the EDS is that of the data type."""


@each_device
def test_after_a_reset_objects_have_their_defaults(wire, node_id: int) -> None:
    for entry in of_device(NUMBERS, node_id):
        if is_history(entry) or entry.variable.index in MEASURED or entry.variable.default is None:
            continue
        expected = entry.variable.default & ((1 << 8 * entry.size) - 1)
        assert int.from_bytes(upload(wire, entry), "little") == expected, str(entry)


@each_device
def test_a_stopped_node_answers_nothing(wire, node_id: int) -> None:
    wire.nmt(0x02, node_id)
    for entry in of_device(ALL, node_id):
        for command in (0x40, 0x22, 0x21, 0xA0, 0xC2):
            assert wire.send(0x600 + node_id, struct.pack("<BHB4x", command, *entry.key)) == [], str(entry)


@pytest.mark.parametrize("index", [0x1010, 0x1011])
@each_device
def test_parameters_are_not_stored_in_operational(wire, node_id: int, index: int) -> None:
    wire.nmt(0x01, node_id)
    signature = b"save" if index == 0x1010 else b"load"
    assert {wire.write(node_id, index, k, signature) for k in (1, 2, 3)} == {0x08000022}

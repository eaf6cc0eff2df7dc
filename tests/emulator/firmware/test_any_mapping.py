"""Whatever a master writes to PDO parameters: what is accepted is what is sent, and it fits into a frame."""

from __future__ import annotations

import struct
from collections import Counter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

NODE = 2
ENTRIES = (
    0x60410010,
    0x60640020,
    0x60770010,
    0x606C0020,
    0x60610008,
    0x10010008,
    0x60400010,
    0x60710010,
    0x00050008,
    0x00070020,
    0x10180120,
    0x55550010,
    0x60410008,
    0x00000000,
)
COMMUNICATION = st.tuples(
    st.sampled_from((0x1800, 0x1801, 0x1802, 0x1400, 0x1401)),
    st.sampled_from((1, 2)),
    st.sampled_from((0x182, 0x80000182, 0x40000282, 0xC0000282, 0x202, 0x80000202, 0x382, 0x80000382, 1, 0, 255, 252)),
)
MAPPING = st.tuples(
    st.sampled_from((0x1A00, 0x1A01, 0x1A02, 0x1600, 0x1601)),
    st.integers(0, 9),
    st.sampled_from((*range(10), *ENTRIES)),
)
PROPER = st.builds(
    lambda base, cob_id, kind, entries: [
        (base, 1, cob_id | 1 << 31),
        (base + 0x200, 0, 0),
        *((base + 0x200, k, entry) for k, entry in enumerate(entries, start=1)),
        (base + 0x200, 0, len(entries)),
        (base, 2, kind),
        (base, 1, cob_id),
    ],
    st.sampled_from((0x1800, 0x1801, 0x1802, 0x1400, 0x1401)),
    st.sampled_from((0x40000182, 0x40000282, 0x202, 0x302)),
    st.sampled_from((0, 1, 1, 2, 255)),
    st.lists(st.sampled_from(ENTRIES[:10]), max_size=8),
)
WRITES = st.lists(st.one_of(COMMUNICATION, MAPPING, PROPER), max_size=25)


@pytest.fixture(scope="module")
def shared_wire(wire_type):
    return wire_type()


def flat(writes) -> list[tuple[int, int, int]]:
    return [single for item in writes for single in (item if isinstance(item, list) else [item])]


def size_of(index: int, subindex: int) -> int:
    if index >= 0x1A00 or 0x1600 <= index < 0x1800:
        return 1 if subindex == 0 else 4
    return 4 if subindex == 1 else 1


@settings(max_examples=150, deadline=None)
@given(WRITES)
def test_every_synchronous_tpdo_is_as_long_as_its_mapping_says(shared_wire, writes) -> None:
    wire = shared_wire
    wire.nmt(0x81, NODE)
    wire.nmt(0x01, NODE)
    for index, subindex, value in flat(writes):
        size = size_of(index, subindex)
        wire.write(NODE, index, subindex, (value & (1 << 8 * size) - 1).to_bytes(size, "little"))
    expected: dict[int, list[int]] = {}
    for index in (0x1800, 0x1801, 0x1802, 0x1803):
        cob_id, kind = wire.read(NODE, index, 1), wire.read(NODE, index, 2)
        count = wire.read(NODE, index + 0x200, 0)
        bits = [wire.read(NODE, index + 0x200, k) & 0xFF for k in range(1, count + 1)]
        assert sum(bits) <= 64
        if not cob_id >> 31 and count and kind == 1:
            expected.setdefault(cob_id & 0x7FF, []).append(sum(bits) // 8)
    sent: dict[int, list[int]] = {}
    for can_id, data in wire.send(0x080):
        if can_id in expected:
            sent.setdefault(can_id, []).append(len(data))
    # TPDOs of other types may share an identifier; those with every SYNC must all be there.
    for can_id, lengths in expected.items():
        assert not Counter(lengths) - Counter(sent.get(can_id, []))


@settings(max_examples=100, deadline=None)
@given(st.lists(st.sampled_from((0x60400010, 0x60710010, 0x607A0020, 0x60FF0020, 0x00050008, 0x00060010)), max_size=8))
def test_an_rpdo_writes_what_its_mapping_says(shared_wire, entries: list[int]) -> None:
    wire = shared_wire
    wire.nmt(0x81, NODE)
    wire.write(NODE, 0x1400, 1, struct.pack("<I", 0x80000202))
    wire.write(NODE, 0x1400, 2, b"\xff")
    wire.write(NODE, 0x1600, 0, b"\x00")
    for k, entry in enumerate(entries, start=1):
        assert wire.write(NODE, 0x1600, k, struct.pack("<I", entry)) == 0
    refused = wire.write(NODE, 0x1600, 0, bytes((len(entries),)))
    assert refused == (0x06040042 if sum(entry & 0xFF for entry in entries) > 64 else 0)
    if refused or not entries:
        return
    wire.write(NODE, 0x1400, 1, struct.pack("<I", 0x202))
    wire.nmt(0x01, NODE)
    values = {entry: 3 + k for k, entry in enumerate(entries)}
    data = b"".join(values[entry].to_bytes((entry & 0xFF) // 8, "little") for entry in entries)
    wire.send(0x202, data)
    for entry, value in values.items():
        if entry >> 16 >= 0x1000:
            assert wire.read(NODE, entry >> 16, entry >> 8 & 0xFF) == value

"""What a master may send to the devices: single frames, and sequences of them drawn at random."""

from __future__ import annotations

import struct
from collections.abc import Sequence

from hypothesis import strategies as st

from fmu.bus.system import BusSystem, ObjectRow
from tests.hil.lsbus.twins import Data, Remote, Stimulus, Wait

MASTER = 0x7F
START, STOP, PRE_OPERATIONAL, RESET_NODE, RESET_COMMUNICATION = 0x01, 0x02, 0x80, 0x81, 0x82
SHUTDOWN, SWITCH_ON, ENABLE, DISABLE_VOLTAGE, QUICK_STOP, FAULT_RESET = 0x06, 0x07, 0x0F, 0x00, 0x02, 0x80
CYCLE = 0.002
SYNC = Data(0x080)
MODE_OF_OPERATION = 0x6060

_EXPEDITED = {1: 0x2F, 2: 0x2B, 4: 0x23}


def nmt(command: int, node: int = 0) -> Data:
    return Data(0x000, bytes((command, node)))


def heartbeat() -> Data:
    return Data(0x700 + MASTER, b"\x05")


def read(node: int, index: int, subindex: int = 0) -> Data:
    return Data(0x600 + node, struct.pack("<BHBI", 0x40, index, subindex, 0))


def write(node: int, index: int, subindex: int, value: int, size: int) -> Data:
    body = (value & (1 << 8 * size) - 1).to_bytes(size, "little").ljust(4, b"\x00")
    return Data(0x600 + node, struct.pack("<BHB", _EXPEDITED[size], index, subindex) + body)


def command(node: int, controlword: int, torque: int = 0) -> Data:
    """RPDO 1 as delivered: 6040h, 6071h."""
    return Data(0x200 + node, struct.pack("<Hh", controlword, torque))


def mapped(node: int, communication: int, entries: Sequence[int], *, transmission: int = 1) -> list[Stimulus]:
    """The order of CiA 301, 7.5.2.36: invalid, no entries, entries, their number, valid."""
    mapping = communication + 0x200
    cob_id = (0x200 if communication < 0x1800 else 0x180) + 0x100 * (communication & 3) + node
    return [
        write(node, communication, 1, cob_id | 1 << 31, 4),
        write(node, communication, 2, transmission, 1),
        write(node, mapping, 0, 0, 1),
        *(write(node, mapping, k, entry, 4) for k, entry in enumerate(entries, start=1)),
        write(node, mapping, 0, len(entries), 1),
        write(node, communication, 1, cob_id, 4),
    ]


def to_operation_enabled(nodes: Sequence[int]) -> list[Stimulus]:
    """Cyclic torque with synchronous PDOs, and through the state machine with a SYNC after each controlword."""
    configured = [stimulus for node in nodes for stimulus in _cyclic(node)]
    words = (DISABLE_VOLTAGE, SHUTDOWN, SWITCH_ON, ENABLE)
    steps = [stimulus for word in words for stimulus in (*(command(node, word) for node in nodes), Wait(CYCLE), SYNC)]
    return [*configured, nmt(START), *steps]


def _cyclic(node: int) -> list[Stimulus]:
    return [
        write(node, MODE_OF_OPERATION, 0, 10, 1),
        *mapped(node, 0x1400, (0x60400010, 0x60710010)),
        *mapped(node, 0x1800, (0x60410010, 0x60770010, 0x60640020)),
    ]


OF_THE_FMU = (0x1021, 0x6502)
"""Objects that say what the device is: its EDS, and its modes of operation, which are fewer in C."""

_RISKY = (0x1005, 0x1014, 0x1016, 0x1400, 0x1401, 0x1402, 0x1403, 0x1800, 0x1801, 0x1802, 0x1803)
"""Objects that say who hears whom: nodes that hear each other's PDOs are served in another order in C."""


def _values(row: ObjectRow) -> st.SearchStrategy[int]:
    if row.index == MODE_OF_OPERATION:
        return st.sampled_from((0, 10))
    bits = 8 * row.size
    low, high = (-(1 << bits - 1), (1 << bits - 1) - 1) if row.signed else (0, (1 << bits) - 1)
    usual = st.integers(max(low, row.minimum), min(high, row.maximum))
    small = st.integers(max(low, -3), min(high, 300))
    return st.one_of(small, usual, st.integers(low, high))


def _writes(node: int, row: ObjectRow) -> st.SearchStrategy[Data]:
    return _values(row).map(lambda value: write(node, row.index, row.subindex, value, row.size))


def sequences(system: BusSystem, longest: int) -> st.SearchStrategy[list[Stimulus]]:
    """Sequences of what masters do, right and wrong."""
    drives = [node for node in system.nodes if node.name.startswith("drive")]
    objects = [
        (node.node_id, row)
        for node in system.nodes
        for row in system.devices[node.device].objects
        if row.index not in OF_THE_FMU
    ]
    writable = [(node, row) for node, row in objects if row.text is None and row.size <= 4 and row.index not in _RISKY]
    node_ids = st.sampled_from([node.node_id for node in system.nodes])
    drive_ids = st.sampled_from([node.node_id for node in drives])
    words = st.one_of(
        st.sampled_from((SHUTDOWN, SWITCH_ON, ENABLE, DISABLE_VOLTAGE, QUICK_STOP, FAULT_RESET)), st.integers(0, 0xFFFF)
    )
    torques = st.one_of(st.integers(-300, 300), st.integers(-32768, 32767))
    one = st.one_of(
        st.sampled_from(objects).map(lambda item: read(item[0], item[1].index, item[1].subindex)),
        st.sampled_from(writable).flatmap(lambda item: _writes(*item)),
        st.builds(
            nmt,
            st.sampled_from((START, START, STOP, PRE_OPERATIONAL, RESET_NODE, RESET_COMMUNICATION)),
            st.integers(0, 7),
        ),
        st.builds(command, drive_ids, words, torques),
        st.builds(command, drive_ids, words, torques),
        st.just(SYNC),
        st.just(heartbeat()),
        st.builds(Remote, st.builds(lambda node, base: node + base, node_ids, st.sampled_from((0x180, 0x280, 0x700)))),
        st.builds(Data, st.builds(lambda node: 0x200 + node, drive_ids), st.binary(max_size=8)),
        st.builds(_segment, node_ids, st.integers(0, 0x1F), st.binary(min_size=7, max_size=7)),
        st.builds(
            _raw_sdo,
            node_ids,
            st.sampled_from((0x00, 0x20, 0x21, 0x60, 0x70, 0x80, 0xE0, 0xFF)),
            st.sampled_from(objects),
        ),
        st.integers(1, 60).map(lambda ms: Wait(ms / 1000)),
        st.integers(1, 3).map(lambda ms: Wait(ms / 1000)),
    )
    begun = st.sampled_from(([], [nmt(START)], to_operation_enabled([node.node_id for node in drives])))
    return st.builds(lambda first, then: [*first, *then], begun, st.lists(one, min_size=1, max_size=longest))


def _segment(node: int, first: int, rest: bytes) -> Data:
    return Data(0x600 + node, bytes((first,)) + rest)


def _raw_sdo(node: int, first: int, item: tuple[int, ObjectRow]) -> Data:
    return Data(0x600 + node, struct.pack("<BHBI", first, item[1].index, item[1].subindex, 4))

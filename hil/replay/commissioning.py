"""Nodes as they were when a log begins in the middle: configured, started, enabled, their encoders where they stood."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Final

import numpy as np

from hil.bench.lockstep import LockstepBench
from hil.frames.table import FrameTable
from hil.master import Master
from hil.master.drive_states import ENABLED_MASK, ENABLED_PATTERN
from hil.network import MappedObject, Network, Node, Pdo, PdoDirection
from hil.network.cia import Index, NmtCommand, Service
from hil.replay.recording import Recording
from ident.errors import RecordError

_BOOTING: Final = (NmtCommand.START, NmtCommand.RESET_NODE)
_MOVING: Final = 0.02
"""Speed of a wheel or steering unit that is no standstill [rad/s]."""


@dataclass(frozen=True)
class FirstSample:
    """What a log that begins in the middle says of the vehicle at its beginning.

    Attributes:
        steering: left, right [rad].
        wheels: fl, rl, fr, rr [rad].
        enabled: all drives are in operation enabled.
        moving: something turns.
    """

    steering: tuple[float, float]
    wheels: tuple[float, float, float, float]
    enabled: bool
    moving: bool


def boots(recording: Recording) -> bool:
    """Whether the nodes are started in the log itself, so that they need nobody else."""
    for _, can_id, data in recording.parts[0].frames():
        if can_id == Service.NMT and data[:1] and data[0] in _BOOTING:
            return True
    return False


def first_sample(recording: Recording, network: Network) -> FirstSample:
    """State of the vehicle at the beginning of a log.

    Raises:
        RecordError: a node has no sample in it.
    """
    table = recording.parts[0].table
    angles, rates = {}, []
    for node in network.nodes:
        index = Index.POSITION_ACTUAL if node.is_drive else Index.ENCODER_POSITION
        counts = _samples(table, node, index, recording)
        half = node.counter_modulus // 2
        angles[node.role] = ((counts[0] - node.zero_counts + half) % node.counter_modulus - half) * node.angle_unit
        rates.append((counts[-1] - counts[0]) * node.angle_unit / max(len(counts) - 1, 1) / network.cycle_period)
    words = [_samples(table, node, Index.STATUSWORD, recording)[0] for node in network.drives]
    left, right = (angles[node.role] for node in network.encoders)
    fl, rl, fr, rr = (angles[node.role] for node in network.drives)
    return FirstSample(
        (left, right),
        (fl, rl, fr, rr),
        all(word & ENABLED_MASK == ENABLED_PATTERN for word in words),
        bool(np.max(np.abs(rates)) > _MOVING),
    )


def commission(bench: LockstepBench, network: Network, recording: Recording, *, enable: bool) -> None:
    """Configure and start the nodes by the network file, as its master would; enable them where the log has them so.

    A log without heartbeats of that master is of another one, or was filtered: then nobody listens for them.
    """
    master = Master(bench.bus, bench.clock, network)
    master.boot()
    if enable:
        master.enable()
    if not recording.holds(Service.HEARTBEAT + network.master_id):
        for node in network.nodes:
            master.object_access(node).write(Index.CONSUMER_HEARTBEAT_TIME, 1, 0)


_FEW: Final = 10
"""Samples that tell how fast something turns."""


def _samples(table: FrameTable, node: Node, index: int, recording: Recording) -> list[int]:
    """The first values of an object that a node samples with the SYNC."""
    pdo, item, offset = _mapped(node, index)
    size = struct.calcsize(pdo.struct_format)
    rows = np.flatnonzero((table.can_id == pdo.cob_id(node.node_id)) & (table.length == size))[:_FEW]
    if not len(rows):
        raise RecordError(
            f"{recording.source} has no samples of {node.label}.",
            "Name the network file that it was recorded with (--network), or a log that begins with the boot-up.",
        )
    form = struct.Struct("<" + item.code)
    return [form.unpack_from(bytes(table.data[row]), offset)[0] for row in rows]


def _mapped(node: Node, index: int) -> tuple[Pdo, MappedObject, int]:
    for pdo in node.pdos:
        offset = 0
        for item in pdo.objects:
            if pdo.direction is PdoDirection.TRANSMIT and item.index == index:
                return pdo, item, offset
            offset += item.bits // 8
    raise AssertionError(f"{index:04X}h was checked to be mapped when the network file was read")

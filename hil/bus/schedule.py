"""Whether the frames of a network fit on a real bus: lengths, load, longest waiting times."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from hil.bus.bit_length import UNSTUFFED_TAIL_BITS, longest_frame_bits
from hil.bus.wire import FrameTiming, longest_responses
from hil.network import Network
from hil.network.cia import Service

_HEARTBEAT_BYTES: Final = 1
_SDO_BYTES: Final = 8
_HEADER_AND_CRC: Final = 19 + 15


@dataclass(frozen=True)
class ScheduledFrame:
    """A frame of the schedule.

    Attributes:
        can_id: 11-bit identifier.
        sender: who sends it, in words.
        length: bytes of data.
        period: shortest time between two of them [s].
        shortest, longest: length on the wire, without and with all stuff bits [bit times].
        response: longest time from its request to its last bit, when all ask at the worst instant [s].
    """

    can_id: int
    sender: str
    length: int
    period: float
    shortest: int
    longest: int
    response: float

    @property
    def in_time(self) -> bool:
        """Whether it has passed before the next one of its kind is asked for."""
        return self.response <= self.period


@dataclass(frozen=True)
class BusSchedule:
    """What a network puts on its bus.

    Attributes:
        bit_rate: [bit/s].
        period: of the cycle [s].
        frames: in the order of their priority.
    """

    bit_rate: float
    period: float
    frames: tuple[ScheduledFrame, ...]

    @property
    def load(self) -> tuple[float, float]:
        """Share of the bus without and with all stuff bits [-]."""
        shortest = sum(frame.shortest / frame.period for frame in self.frames)
        longest = sum(frame.longest / frame.period for frame in self.frames)
        return shortest / self.bit_rate, longest / self.bit_rate

    @property
    def late(self) -> tuple[ScheduledFrame, ...]:
        """Frames that may not be through before the next one of their kind is due: a real bus cannot work so."""
        return tuple(frame for frame in self.frames if not frame.in_time)


def schedule(network: Network, bit_rate: float | None = None, period: float | None = None) -> BusSchedule:
    """The schedule of SYNC, PDOs, heartbeats, and one SDO transfer at a time.

    Args:
        network: the network file.
        bit_rate: another bit rate [bit/s].
        period: another cycle period [s].
    """
    rate, cycle = bit_rate or network.bit_rate, period or network.cycle_period
    found = sorted(_frames(network, cycle), key=lambda frame: frame[0])
    timings = [FrameTiming(can_id, longest_frame_bits(length), every) for can_id, _, length, every in found]
    responses: Mapping[int, float] = longest_responses(timings, rate)
    return BusSchedule(
        rate,
        cycle,
        tuple(
            ScheduledFrame(
                can_id,
                sender,
                length,
                every,
                _HEADER_AND_CRC + 8 * length + UNSTUFFED_TAIL_BITS,
                longest_frame_bits(length),
                responses[can_id],
            )
            for can_id, sender, length, every in found
        ),
    )


def _frames(network: Network, cycle: float) -> Iterator[tuple[int, str, int, float]]:
    """Identifier, sender, length and period of every periodic frame."""
    yield network.sync_cob_id, "master: SYNC", 0, cycle
    yield (
        Service.HEARTBEAT + network.master_id,
        "master: heartbeat",
        _HEARTBEAT_BYTES,
        network.times["heartbeat_period"],
    )
    for node in network.nodes:
        for pdo in node.pdos:
            length = math.ceil(sum(item.bits for item in pdo.objects) / 8)
            sender = f"{node.role}: {pdo.direction} PDO {pdo.number}"
            yield pdo.cob_id(node.node_id), sender, length, pdo.transmission_type * cycle
        beat = node.quantities["heartbeat_period"].value
        yield Service.HEARTBEAT + node.node_id, f"{node.role}: heartbeat", _HEARTBEAT_BYTES, beat
    # One transfer at a time, each request answered before the next: two frames within the time-out at most count.
    last = max(node.node_id for node in network.nodes)
    yield Service.SDO_ANSWER + last, "any node: SDO answer", _SDO_BYTES, network.times["sdo_timeout"]
    yield Service.SDO_REQUEST + last, "master: SDO request", _SDO_BYTES, network.times["sdo_timeout"]

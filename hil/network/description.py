"""What a network file says: which nodes are on the bus, how they are wired, and what their PDOs carry."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import canopen

from hil.buses.bit_length import longest_frame_bits
from ident.vehicle.quantities import Quantity


class Role(StrEnum):
    """What a node does on the vehicle; drives in the wheel order fl, rl, fr, rr."""

    DRIVE_FL = "drive_fl"
    DRIVE_RL = "drive_rl"
    DRIVE_FR = "drive_fr"
    DRIVE_RR = "drive_rr"
    ENCODER_LEFT = "encoder_left"
    ENCODER_RIGHT = "encoder_right"


DRIVES = (Role.DRIVE_FL, Role.DRIVE_RL, Role.DRIVE_FR, Role.DRIVE_RR)
ENCODERS = (Role.ENCODER_LEFT, Role.ENCODER_RIGHT)


class PdoDirection(StrEnum):
    """Direction of a PDO, seen from the node (CiA 301)."""

    RECEIVE = "receive"
    TRANSMIT = "transmit"


@dataclass(frozen=True)
class Identity:
    """Objects 1000h and 1018h:1-3 that a node must answer with."""

    device_type: int
    vendor_id: int
    product_code: int
    revision_number: int


@dataclass(frozen=True)
class MappedObject:
    """An object in a PDO; `code` is its `struct` format character."""

    name: str
    index: int
    subindex: int
    code: str
    bits: int

    @property
    def mapping_entry(self) -> int:
        """The value of a mapping object (CiA 301: index, subindex, length in bits)."""
        return self.index << 16 | self.subindex << 8 | self.bits


@dataclass(frozen=True)
class Pdo:
    """One PDO of a node."""

    direction: PdoDirection
    number: int
    transmission_type: int
    objects: tuple[MappedObject, ...]

    @property
    def struct_format(self) -> str:
        """Format of the whole PDO for `struct` (little-endian, no padding)."""
        return "<" + "".join(item.code for item in self.objects)

    @property
    def communication_index(self) -> int:
        """Index of the communication parameter (1400h.. or 1800h..)."""
        return (0x1400 if self.direction is PdoDirection.RECEIVE else 0x1800) + self.number - 1

    @property
    def mapping_index(self) -> int:
        """Index of the mapping parameter (1600h.. or 1A00h..)."""
        return self.communication_index + 0x200

    def cob_id(self, node_id: int) -> int:
        """COB-ID of the predefined connection set (CiA 301, table 38)."""
        base = 0x200 if self.direction is PdoDirection.RECEIVE else 0x180
        return base + 0x100 * (self.number - 1) + node_id


@dataclass(frozen=True)
class Node:
    """One node: address, expected identity, mounting and PDO layout. SI units, counts where it says so."""

    node_id: int
    role: Role
    eds: Path
    object_dictionary: canopen.ObjectDictionary
    identity: Identity
    rotation: int
    zero_counts: int
    quantities: Mapping[str, Quantity]
    pdos: tuple[Pdo, ...]

    @property
    def label(self) -> str:
        """How errors name the node."""
        return f"node {self.node_id} ({self.role})"

    @property
    def torque_unit(self) -> float:
        """Motor torque, vehicle sign, of one per mille of 6076h [Nm]."""
        return self.rotation * self.quantities["rated_torque"].value / 1000.0

    @property
    def angle_unit(self) -> float:
        """Wheel or steering angle, vehicle sign, of one count [rad]."""
        counts = self.quantities["counts_per_revolution"].value * self.quantities["gear_ratio"].value
        return self.rotation * 2.0 * math.pi / counts

    @property
    def counter_modulus(self) -> int:
        """Count at which the position object wraps around."""
        span = self.quantities.get("measuring_range")
        return 2**32 if span is None else int(span.value)


@dataclass(frozen=True)
class Network:
    """The whole network file. Times in s, bit rate in bit/s."""

    name: str
    path: Path
    bit_rate: float
    cycle_period: float
    master_id: int
    sync_cob_id: int
    times: Mapping[str, float]
    nodes: tuple[Node, ...]

    @property
    def worst_bus_load(self) -> float:
        """Largest share of the bus that SYNC and PDOs can take, with every possible stuff bit."""
        bits = float(longest_frame_bits(0))
        for node in self.nodes:
            for pdo in node.pdos:
                length = sum(item.bits for item in pdo.objects) // 8
                bits += longest_frame_bits(length) / pdo.transmission_type
        return bits / (self.bit_rate * self.cycle_period)

    def node(self, role: Role) -> Node:
        """The node with this role."""
        return next(node for node in self.nodes if node.role is role)

    @property
    def drives(self) -> tuple[Node, ...]:
        """The four drives, in wheel order fl, rl, fr, rr."""
        return tuple(self.node(role) for role in DRIVES)

    @property
    def encoders(self) -> tuple[Node, ...]:
        """The two steering encoders, left and right."""
        return tuple(self.node(role) for role in ENCODERS)

"""What a network file says: which nodes are on the bus, how they are wired, and what their PDOs carry."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path

import canopen

from hil.bus.bit_length import longest_frame_bits
from hil.network.cia import PDO_MAPPING, PDO_SPACING, Index, Service
from ident.errors import DataFileError
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
        return (
            (Index.RPDO_COMMUNICATION if self.direction is PdoDirection.RECEIVE else Index.TPDO_COMMUNICATION)
            + self.number
            - 1
        )

    @property
    def mapping_index(self) -> int:
        """Index of the mapping parameter (1600h.. or 1A00h..)."""
        return self.communication_index + PDO_MAPPING

    def cob_id(self, node_id: int) -> int:
        """COB-ID of the predefined connection set (CiA 301, table 38)."""
        base = Service.RPDO_1 if self.direction is PdoDirection.RECEIVE else Service.TPDO_1
        return base + PDO_SPACING * (self.number - 1) + node_id


@dataclass(frozen=True)
class Node:
    """One node: address, expected identity, mounting and PDO layout. SI units, counts where it says so.

    `device` is the name of its table in the network file. Of the quantities of a drive, those that the vehicle file
    owns may be missing until `Network.completed` has added them.
    """

    node_id: int
    role: Role
    eds: Path
    object_dictionary: canopen.ObjectDictionary
    identity: Identity
    rotation: int
    zero_counts: int
    quantities: Mapping[str, Quantity]
    pdos: tuple[Pdo, ...]
    device: str = ""

    @property
    def label(self) -> str:
        """How errors name the node."""
        return f"node {self.node_id} ({self.role})"

    @property
    def is_drive(self) -> bool:
        """A wheel drive, and no encoder."""
        return self.role in DRIVES

    def quantity(self, name: str) -> float:
        """A number of its device, SI.

        Raises:
            DataFileError: the network file leaves it to the vehicle file, and was read without one.
        """
        if name not in self.quantities:
            raise DataFileError(
                f"The network file does not give {name} of {self.label}: the vehicle file owns it.",
                "Name the vehicle file too (--vehicle), or write the same number into the network file.",
            )
        return self.quantities[name].value

    @property
    def torque_unit(self) -> float:
        """Motor torque, vehicle sign, of one per mille of 6076h [Nm]."""
        return self.rotation * self.quantity("rated_torque") / 1000.0

    @property
    def angle_unit(self) -> float:
        """Wheel or steering angle, vehicle sign, of one count [rad]."""
        counts = self.quantity("counts_per_revolution") * self.quantity("gear_ratio")
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

    def completed(self, gear_ratio: float, rated_torque: float, source: str) -> Network:
        """With what the vehicle file owns [-, Nm] where the network file leaves it out; `source` names the file."""
        owned = {
            "gear_ratio": Quantity(gear_ratio, "1", source),
            "rated_torque": Quantity(rated_torque, "Nm", source),
        }
        nodes = (
            replace(node, quantities={**owned, **node.quantities}) if node.is_drive else node for node in self.nodes
        )
        return replace(self, nodes=tuple(nodes))

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

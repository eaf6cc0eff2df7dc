"""The devices that an FMU has on its bus, as plain numbers: object dictionaries, nodes, data sheets."""

from __future__ import annotations

import enum
from dataclasses import dataclass


class DeviceKind(enum.StrEnum):
    """Device profiles; the value is the name in C."""

    DRIVE = "QB_DRIVE"
    ENCODER = "QB_ENCODER"


class TxClock(enum.StrEnum):
    """How an importer learns that frames are to be sent (FMI-LS-BUS, "Tx Clocks")."""

    COUNTDOWN = "countdown"
    """The instant is told in advance."""
    TRIGGERED = "triggered"
    """The clock is found to tick where a step ends: for importers that know no other."""


@dataclass(frozen=True)
class ObjectRow:
    """One entry of an object dictionary.

    Attributes:
        index, subindex: of CiA 301.
        size: bytes of a number.
        signed: two's complement.
        readable, writable: by SDO.
        receivable, transmittable: an RPDO, a TPDO may carry it.
        start: at power-on; of the node with the identifier zero where `of_node` is set.
        of_node: the node-ID adds to `start`.
        minimum, maximum: bounds of what may be written.
        text: bytes of a text or domain; None for a number.
    """

    index: int
    subindex: int
    size: int = 0
    signed: bool = False
    readable: bool = True
    writable: bool = False
    receivable: bool = False
    transmittable: bool = False
    start: int = 0
    of_node: bool = False
    minimum: int = 0
    maximum: int = 0
    text: bytes | None = None


@dataclass(frozen=True)
class BusDevice:
    """A kind of device: its profile, its object dictionary by index, and its EDS file."""

    kind: DeviceKind
    objects: tuple[ObjectRow, ...]
    eds: bytes


@dataclass(frozen=True)
class BusNode:
    """A node: its name, its device among those of the bus, its node-ID, and which drive or encoder it is."""

    name: str
    device: int
    node_id: int
    place: int


@dataclass(frozen=True)
class DriveSheet:
    """Power stage, current loop and motor of the drives.

    Attributes:
        counts: increments per turn of the shaft.
        rated_torque, peak_torque: [Nm].
        rated_current: [A].
        ramp_steps: steps of 1 ms over which a set-point of the bus is reached.
        keep, from_start, from_end: exact response of the current loop over a step of 1 ms.
        supply_energy, chopper_energy, trip_energy: of the DC link [J].
        capacitance: of it [F].
        chopped: what the chopper takes in a step of 1 ms [J].
        chopper_voltage, over_voltage: [V].
        copper: losses per torque squared [W/(Nm)²].
        heating: share by which the thermal load nears its end in a step of 1 ms [-].
        peak_level: torque from which on the peak time counts [Nm].
        peak_time, stall_time: [s].
    """

    counts: int
    rated_torque: float
    peak_torque: float
    rated_current: float
    ramp_steps: int
    keep: float
    from_start: float
    from_end: float
    supply_energy: float
    chopper_energy: float
    trip_energy: float
    capacitance: float
    chopped: float
    chopper_voltage: float
    over_voltage: float
    copper: float
    heating: float
    peak_level: float
    peak_time: float
    stall_time: float


@dataclass(frozen=True)
class Mounting:
    """A motor: turns of the shaft per turn of what it drives, signed."""

    shaft_ratio: float


@dataclass(frozen=True)
class Disc:
    """An encoder of a steering angle: increments per rad, signed, and its count at zero."""

    scale: float
    zero: int


@dataclass(frozen=True)
class BusSystem:
    """All that is on the bus.

    Attributes:
        bit_rate: [bit/s].
        devices, nodes: object dictionaries, and who has them, by node-ID.
        drive: data sheet of the drives.
        mountings: of the drives.
        discs: steering encoders; none where the FMU is a drive alone.
        encoder_counts: increments per turn of theirs.
        gear_ratio: torque of the plant's drive inputs is that of the wheel over this.
        torque_noise: rms of torque readings, of rated torque [-].
        encoder_noise: rms ahead of the rounding to increments [increments].
        tx_clock: of the bus terminal.
    """

    bit_rate: int
    devices: tuple[BusDevice, ...]
    nodes: tuple[BusNode, ...]
    drive: DriveSheet
    mountings: tuple[Mounting, ...]
    discs: tuple[Disc, ...]
    encoder_counts: int
    gear_ratio: float
    torque_noise: float
    encoder_noise: float
    tx_clock: TxClock = TxClock.COUNTDOWN


@dataclass(frozen=True)
class PlantPorts:
    """Value references of the plant, by drive or encoder: what drives act on, and what encoders see.

    Attributes:
        torques: inputs that the drives set.
        wheel_angles, wheel_rates: of what the motors turn [rad, rad/s].
        steering_angles: [rad].
    """

    torques: tuple[int, ...]
    wheel_angles: tuple[int, ...]
    wheel_rates: tuple[int, ...]
    steering_angles: tuple[int, ...]

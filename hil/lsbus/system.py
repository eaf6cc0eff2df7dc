"""The emulated devices of a vehicle as tables for an FMU: object dictionaries from EDS files, and data sheets."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Final

from durand.datatypes import is_numeric

from emulator.firmware.description import DRIVE_ROLES, ENCODER_ROLES, NodeDescription, read_network_description
from emulator.firmware.dictionary import STORE_EDS, STRUCT_CODES, Dictionary
from emulator.power_stage import PEAK_SHARE, thermal_time_constant
from emulator.prototype import Prototype
from fmu.bus.system import BusDevice, BusNode, BusSystem, DeviceKind, Disc, DriveSheet, Mounting, ObjectRow, TxClock
from hil.lsbus.eds import CYCLIC_TORQUE_ALONE, SUPPORTED_MODES, is_served, kind_of, served_eds
from hil.network import load_network
from ident.errors import DataFileError
from ident.reading import read_text

STEP: Final = 1e-3
"""Of the power stage and the plant [s]."""

_INTEGERS: Final = "bBhHiIqQ"
"""`struct` codes that the C firmware has."""


def vehicle_on_bus(prototype: Prototype, network: Path, tx_clock: TxClock = TxClock.COUNTDOWN) -> BusSystem:
    """The four drives and two encoders of a vehicle.

    Raises:
        DataFileError: a file is missing or malformed, or an object cannot be in an FMU.
    """
    return _system(prototype, network, (*DRIVE_ROLES, *ENCODER_ROLES), tx_clock)


def drive_on_bus(prototype: Prototype, network: Path, role: str, tx_clock: TxClock = TxClock.COUNTDOWN) -> BusSystem:
    """One drive alone, whose plant is its own motor shaft, in the drive's sense of rotation.

    Raises:
        DataFileError: as `vehicle_on_bus`, or the role is none of a drive.
    """
    if role not in DRIVE_ROLES:
        raise DataFileError(f"There is no drive {role!r}.", f"Name one of {', '.join(DRIVE_ROLES)}.")
    return _system(prototype, network, (role,), tx_clock)


def _system(prototype: Prototype, network: Path, roles: tuple[str, ...], tx_clock: TxClock) -> BusSystem:
    described = [node for node in read_network_description(network).nodes if node.role in roles]
    alone = len(roles) == 1
    kinds = sorted({(node.eds, kind_of(node.role)) for node in described})
    ratio = prototype.geometry.gear_ratio
    nodes = tuple(
        BusNode(node.role, kinds.index((node.eds, kind_of(node.role))), node.node_id, 0 if alone else _place(node))
        for node in described
    )
    encoder = prototype.encoder
    discs = tuple(
        Disc(direction * encoder.counts_per_revolution / math.tau, zero)
        for direction, zero in zip(encoder.directions, encoder.zero_positions, strict=True)
    )
    return BusSystem(
        bit_rate=round(load_network(network).bit_rate),
        devices=tuple(_device(eds, kind) for eds, kind in kinds),
        nodes=nodes,
        drive=_drive_sheet(prototype),
        mountings=(Mounting(1.0),) if alone else tuple(Mounting(sign * ratio) for sign in prototype.drive.directions),
        discs=() if alone else discs,
        encoder_counts=encoder.counts_per_revolution,
        gear_ratio=1.0 if alone else ratio,
        torque_noise=prototype.noise.torque_sensor,
        encoder_noise=prototype.noise.encoder_dither,
        tx_clock=tx_clock,
    )


def _place(node: NodeDescription) -> int:
    roles = DRIVE_ROLES if node.role in DRIVE_ROLES else ENCODER_ROLES
    return roles.index(node.role)


def _device(eds: Path, kind: DeviceKind) -> BusDevice:
    text = served_eds(read_text(eds), kind)
    first, second = (Dictionary(eds, node_id) for node_id in (1, 2))
    rows = []
    for (index, subindex, variable), (_, _, shifted) in zip(first.entries(), second.entries(), strict=True):
        if not is_served(kind, index):
            continue
        readable, writable = bool(variable.readable), bool(variable.writable)
        if not is_numeric(variable.datatype):
            if writable:
                raise _not_in_fmu(eds, index, subindex, "is a text that can be written")
            content = text.encode() if index == STORE_EDS else bytes(variable.value or b"")
            rows.append(ObjectRow(index, subindex, text=content, readable=readable))
            continue
        code = STRUCT_CODES.get(variable.datatype, "")
        if code not in _INTEGERS or not code:
            raise _not_in_fmu(eds, index, subindex, "is no integer")
        key, of_node = (index, subindex), variable.value != shifted.value
        start = CYCLIC_TORQUE_ALONE if index == SUPPORTED_MODES and kind is DeviceKind.DRIVE else variable.value or 0
        rows.append(
            ObjectRow(
                index,
                subindex,
                size=variable.size,
                readable=readable,
                writable=writable,
                signed=code.islower(),
                receivable=key in first.receivable,
                transmittable=key in first.transmittable,
                start=start - of_node,
                of_node=of_node,
                minimum=variable.minimum,
                # Bounds of C's longest integer; the firmware compares signed.
                maximum=min(variable.maximum, 2**63 - 1),
            )
        )
    return BusDevice(kind, tuple(rows), text.encode())


def _not_in_fmu(eds: Path, index: int, subindex: int, why: str) -> DataFileError:
    return DataFileError(
        f"{eds}: object {index:04X}h:{subindex} {why}, which the devices of an FMU have not.",
        "Correct it in a copy of the EDS, or take the object out.",
    )


def _drive_sheet(prototype: Prototype) -> DriveSheet:
    drive, stage = prototype.drive, prototype.power_stage
    lag = drive.current_loop_bandwidth * STEP
    keep = math.exp(-lag)
    from_end = 1 - (1 - keep) / lag
    ratio = drive.peak_torque / drive.rated_torque

    def energy(voltage: float) -> float:
        return 0.5 * stage.link_capacitance * voltage**2

    return DriveSheet(
        counts=drive.counts_per_revolution,
        rated_torque=drive.rated_torque,
        peak_torque=drive.peak_torque,
        rated_current=drive.rated_current,
        ramp_steps=max(1, round(drive.interpolation_time / STEP)),
        keep=keep,
        from_start=1 - keep - from_end,
        from_end=from_end,
        supply_energy=energy(stage.supply_voltage),
        chopper_energy=energy(stage.chopper_voltage),
        trip_energy=energy(stage.over_voltage),
        capacitance=stage.link_capacitance,
        chopped=stage.chopper_power * STEP,
        chopper_voltage=stage.chopper_voltage,
        over_voltage=stage.over_voltage,
        copper=3.0 * stage.phase_resistance * (drive.rated_current / drive.rated_torque) ** 2,
        heating=-math.expm1(-STEP / thermal_time_constant(stage.overload_time, ratio)),
        peak_level=PEAK_SHARE * drive.peak_torque,
        peak_time=stage.peak_time,
        stall_time=stage.stall_time,
    )

"""A vehicle as its files describe it together: vehicle file, network file, EDS files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from hil.network import Network, load_network
from hil.network.agreement import refuse_disagreement
from ident.vehicle.description import LIMIT_UNITS, VehicleDescription, load_vehicle
from ident.vehicle.geometry import GEOMETRY_UNITS
from ident.vehicle.parameters import PARAMETER_UNITS


@dataclass(frozen=True)
class Described:
    """A vehicle and its network; they agree, and the network has what the vehicle file owns."""

    vehicle: VehicleDescription
    network: Network


def load_described(vehicle: str | Path, network: Path) -> Described:
    """Read a vehicle file and its network file, and see that they describe one vehicle.

    Args:
        vehicle: shipped vehicle file by name, or a path.
        network: network file.

    Raises:
        DataFileError: a file is missing or malformed, or two places disagree.
    """
    loaded, wired = load_vehicle(vehicle), load_network(network)
    refuse_disagreement(loaded, wired)
    source = f"vehicle file {loaded.path}"
    network_of_vehicle = wired.completed(loaded.geometry.gear_ratio, loaded.limits.rated_torque, source)
    return Described(loaded, network_of_vehicle)


def differences(one: VehicleDescription, other: VehicleDescription) -> list[str]:
    """In what two vehicle files differ, as `geometry.wheelbase 1.2 -> 1.3 m`; empty where they do not."""
    tables = (
        ("geometry", GEOMETRY_UNITS, one.geometry, other.geometry),
        ("limits", LIMIT_UNITS, one.limits, other.limits),
    )
    changed = [
        f"{table}.{name} {getattr(before, name):.6g} -> {getattr(after, name):.6g} {unit}"
        for table, units, before, after in tables
        for name, unit in units.items()
        if getattr(before, name) != getattr(after, name)
    ]
    changed += [
        f"prior.{name} {one.prior[name]:.6g} -> {other.prior[name]:.6g} {unit}"
        for name, unit in PARAMETER_UNITS.items()
        if one.prior[name] != other.prior[name]
    ]
    return changed


def told_differences(taken: VehicleDescription, own: VehicleDescription) -> str:
    """A sentence on in what a vehicle file that was asked for differs from that of a run; empty where it does not."""
    changed = differences(own, taken)
    return (
        f"By {taken.path}, not by {own.path}, with which the run was driven: {'; '.join(changed)}." if changed else ""
    )

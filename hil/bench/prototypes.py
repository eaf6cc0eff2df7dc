"""The prototype that the emulator plays for a vehicle: its own file, or derived from vehicle and network file.

Loads without the physics engine.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from emulator.derivation import Wiring, derive_prototype
from emulator.prototype import Prototype, load_prototype
from hil.network import DRIVES, ENCODERS, Network, load_network
from hil.network.agreement import Stated, refuse_disagreement
from hil.network.described import Described, load_described
from ident.errors import DataFileError
from ident.vehicle.description import load_vehicle
from ident.vehicle.geometry import GEOMETRY_UNITS
from ident.vehicle.quantities import read_toml


def is_vehicle_file(name_or_path: str | Path) -> bool:
    """Whether that is the path of a vehicle file, and neither a shipped name nor a prototype file.

    Raises:
        DataFileError: it is the path of no TOML file.
    """
    return _is_path(name_or_path) and "truth" not in read_toml(Path(name_or_path))


def _is_path(name_or_path: str | Path) -> bool:
    return bool(Path(name_or_path).suffix) or "/" in str(name_or_path)


@dataclass(frozen=True)
class Emulated:
    """What the emulator plays.

    Attributes:
        prototype: the vehicle behind the connector.
        network: its network, complete.
        assumed: what no file says of the prototype, a line each.
    """

    prototype: Prototype
    network: Network
    assumed: tuple[str, ...] = ()


def load_emulated(name_or_path: str | Path, network: Path) -> Emulated:
    """The prototype of that name or file behind a network; nothing is assumed where it has a file of its own.

    Args:
        name_or_path: shipped prototype by name, or the path of a vehicle file or a prototype file.
        network: network file.

    Raises:
        DataFileError: a file is missing or malformed, two places disagree, or no body can have the priors.
    """
    if is_vehicle_file(name_or_path):
        return derive_emulated(load_described(name_or_path, network))
    prototype, wired = load_prototype(name_or_path), load_network(network)
    vehicle = None if _is_path(name_or_path) else load_vehicle(name_or_path)
    refuse_disagreement(vehicle, wired, stated_by(prototype))
    source = f"prototype file {prototype.path}"
    return Emulated(prototype, wired.completed(prototype.geometry.gear_ratio, prototype.drive.rated_torque, source))


def derive_emulated(described: Described) -> Emulated:
    """The prototype for a vehicle and its network.

    Raises:
        DataFileError: no body can have the priors, or the emulator has no such wiring.
    """
    derived = derive_prototype(described.vehicle, _wiring(described.network))
    return Emulated(derived.prototype, described.network, tuple(derived.lines()))


def _wiring(network: Network) -> Wiring:
    for name, nodes in (("drives", network.drives), ("encoders", network.encoders)):
        if len({node.quantities["counts_per_revolution"].value for node in nodes}) > 1:
            raise DataFileError(
                f"{network.path}: the {name} have different counts_per_revolution.",
                "The emulator has one kind of each: rehearse with one, or drive without a rehearsal.",
            )
    if any(node.quantity("gear_ratio") != 1.0 for node in network.encoders):
        raise DataFileError(
            f"{network.path}: a steering encoder has a gear.",
            "The emulator's encoders are on the steering axes: drive without a rehearsal.",
        )
    return Wiring(
        drive_counts=int(network.drives[0].quantity("counts_per_revolution")),
        drive_directions=tuple(node.rotation for node in network.drives),
        encoder_counts=int(network.encoders[0].quantity("counts_per_revolution")),
        encoder_zeros=tuple(node.zero_counts for node in network.encoders),
        encoder_directions=tuple(node.rotation for node in network.encoders),
        cycle_period=network.cycle_period,
    )


def stated_by(prototype: Prototype) -> Iterator[Stated]:
    """The numbers of a prototype file that vehicle and network file own."""
    drive, encoder, where = prototype.drive, prototype.encoder, prototype.path
    for name, unit in GEOMETRY_UNITS.items():
        yield Stated(name, getattr(prototype.geometry, name), unit, f"{where}: [geometry] {name}")
    for name in ("rated_torque", "peak_torque"):
        yield Stated(name, getattr(drive, name), "Nm", f"{where}: [drive] {name}")
    counts = "counts_per_revolution"
    for role, direction in zip(DRIVES, drive.directions, strict=True):
        yield Stated(f"{counts} of {role}", drive.counts_per_revolution, "1", f"{where}: [drive] {counts}")
        place = f"{where}: [drive] direction_{role.removeprefix('drive_')}"
        yield Stated(f"rotation of {role}", direction, "1", place)
    for role, direction, zero in zip(ENCODERS, encoder.directions, encoder.zero_positions, strict=True):
        table = f"{where}: [steering_encoder]"
        yield Stated(f"{counts} of {role}", encoder.counts_per_revolution, "1", f"{table} {counts}")
        yield Stated(f"zero_counts of {role}", zero, "1", f"{table} zero_position, of {role},")
        place = f"{table} direction_{role.removeprefix('encoder_')}"
        yield Stated(f"rotation of {role}", direction, "1", place)

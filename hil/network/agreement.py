"""Numbers that stand in more than one file: they are equal, or the files are refused with both places named.

The vehicle file owns mechanics and limits, the network file identities, units and directions. A prototype file of
the emulator and an EDS file repeat some of both. A default of zero, or none, in an EDS file says nothing.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

import canopen

from hil.network import Network, Node
from hil.network.cia import Index
from ident.errors import DataFileError
from ident.vehicle.description import LIMIT_UNITS, VehicleDescription
from ident.vehicle.geometry import GEOMETRY_UNITS

_RELATIVE: Final = 1e-12
"""Difference at which two written numbers are still the same one [-]."""


@dataclass(frozen=True)
class Stated:
    """A number as one file states it.

    Attributes:
        key: what it is; statements of one key must be equal.
        value: SI, or as the object of the EDS file.
        unit: of the value, "1" for none.
        place: file, table and key.
        grain: smallest step in which the place can state it.
    """

    key: str
    value: float
    unit: str
    place: str
    grain: float = 0.0

    def __str__(self) -> str:
        unit = "" if self.unit == "1" else f" {self.unit}"
        value = f"{int(self.value):#x}" if self.unit == "hex" else f"{self.value:.12g}{unit}"
        return f"{self.place} = {value}"

    def equals(self, other: Stated) -> bool:
        """Whether both mean the same number, as finely as both can state it."""
        grain = max(self.grain, other.grain)
        return math.isclose(self.value, other.value, rel_tol=_RELATIVE, abs_tol=0.5000001 * grain)


@dataclass(frozen=True)
class Disagreement:
    """Two places that state one number differently; `owner` is the one to believe."""

    owner: Stated
    other: Stated

    @property
    def what(self) -> str:
        """Both places with their numbers, one sentence."""
        return f"{self.owner}, but {self.other}."

    @property
    def remedy(self) -> str:
        """What to do."""
        return (
            "Make them equal: the vehicle file owns mechanics and limits, the network file identities, units and "
            f"directions, so {self.owner.place.partition(':')[0]} counts."
        )


def refuse_disagreement(vehicle: VehicleDescription | None, network: Network, more: Iterable[Stated] = ()) -> None:
    """Refuse files that do not describe one vehicle.

    Args:
        vehicle: its vehicle file, where it is known.
        network: its network file, with the EDS files that it names.
        more: what a prototype of the emulator states.

    Raises:
        DataFileError: with the first two places that disagree.
    """
    for found in disagreements(vehicle, network, more):
        raise DataFileError(found.what, found.remedy)


def disagreements(
    vehicle: VehicleDescription | None, network: Network, more: Iterable[Stated] = ()
) -> Iterator[Disagreement]:
    """All pairs of places that state one number differently."""
    stated = [*([] if vehicle is None else _of_vehicle(vehicle)), *_of_network(network), *more, *_of_eds(network)]
    owners: dict[str, Stated] = {}
    told = set()
    for one in stated:
        owner = owners.setdefault(one.key, one)
        if not owner.equals(one) and one.place not in told:
            told.add(one.place)
            yield Disagreement(owner, one)


def _of_vehicle(vehicle: VehicleDescription) -> Iterator[Stated]:
    where = str(vehicle.path or vehicle.name)
    for name, unit in GEOMETRY_UNITS.items():
        yield Stated(name, getattr(vehicle.geometry, name), unit, f"{where}: [geometry] {name}")
    for name, unit in LIMIT_UNITS.items():
        yield Stated(name, getattr(vehicle.limits, name), unit, f"{where}: [limits] {name}")


def _of_network(network: Network) -> Iterator[Stated]:
    for node in network.nodes:
        table = f"{network.path}: [devices.{node.device}"
        for name, quantity in node.quantities.items():
            yield Stated(_key(name, node), quantity.value, quantity.unit, f"{table}.quantities] {name}")
        for name in node.identity.__dataclass_fields__:
            value = getattr(node.identity, name)
            yield Stated(f"{name} of {node.role}", value, "hex", f"{table}.identity] {name}, of {node.label},")
        for name in ("rotation", "zero_counts"):
            value = getattr(node, name)
            yield Stated(f"{name} of {node.role}", value, "1", f"{network.path}: {name} of {node.label}")


def _key(name: str, node: Node) -> str:
    """Gear and rated torque are the same at all wheels; the other quantities are of a node."""
    shared = name in ("gear_ratio", "rated_torque") and node.is_drive
    return name if shared else f"{name} of {node.role}"


@dataclass(frozen=True)
class _Repeated:
    """An object of an EDS file that repeats a number: its key, address, factor to the key's unit, and unit."""

    name: str
    index: int
    subindex: int
    factor: float = 1.0
    unit: str = "1"


_IDENTITY: Final = (
    _Repeated("device_type", Index.DEVICE_TYPE, 0, unit="hex"),
    _Repeated("vendor_id", Index.IDENTITY, 1, unit="hex"),
    _Repeated("product_code", Index.IDENTITY, 2, unit="hex"),
    _Repeated("revision_number", Index.IDENTITY, 3, unit="hex"),
)
_DRIVE: Final = (*_IDENTITY, _Repeated("rated_torque", Index.MOTOR_RATED_TORQUE, 0, 1e-3, "Nm"))
_ENCODER: Final = (
    *_IDENTITY,
    _Repeated("counts_per_revolution", Index.MEASURING_UNITS_PER_REVOLUTION, 0),
    _Repeated("measuring_range", Index.TOTAL_MEASURING_RANGE, 0),
)


def _of_eds(network: Network) -> Iterator[Stated]:
    for node in network.nodes:
        for item in _DRIVE if node.is_drive else _ENCODER:
            value = default_of(node.object_dictionary, item.index, item.subindex)
            if value:
                place = f"{node.eds}: default of {item.index:04X}h:{item.subindex}"
                yield Stated(_key(item.name, node), value * item.factor, item.unit, place, _grain(item))
        if node.is_drive:
            yield from _resolution(node)


def _grain(item: _Repeated) -> float:
    return item.factor if item.factor != 1.0 else 0.0


def _resolution(node: Node) -> Iterator[Stated]:
    """608Fh gives increments and revolutions."""
    increments, turns = (default_of(node.object_dictionary, Index.ENCODER_RESOLUTION, subindex) for subindex in (1, 2))
    if increments:
        place = f"{node.eds}: default of 608Fh:1 over 608Fh:2"
        yield Stated(f"counts_per_revolution of {node.role}", increments / (turns or 1.0), "1", place)


def default_of(dictionary: canopen.ObjectDictionary, index: int, subindex: int) -> float | None:
    """What an EDS or DCF file says that an object holds, ParameterValue before DefaultValue; None where it does not."""
    variable = dictionary.get_variable(index, subindex)
    if variable is None:
        return None
    said = variable.default if getattr(variable, "value", None) is None else variable.value
    return float(said) if isinstance(said, int | float) else None

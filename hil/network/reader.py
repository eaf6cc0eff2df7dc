"""Reader of the network file and of the EDS files it names."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import canopen

from hil.network.checks import check_complete, check_network, check_positive
from hil.network.description import DRIVES, Identity, MappedObject, Network, Node, Pdo, PdoDirection, Role
from ident.errors import DataFileError
from ident.vehicle.quantities import Quantity, read_quantities, read_toml, require_table

DEFAULT_NETWORK = Path(__file__).parent.parent / "data" / "network.toml"

_COMMON_UNITS = {
    "counts_per_revolution": "1",
    "gear_ratio": "1",
    "heartbeat_period": "s",
    "heartbeat_timeout": "s",
}
_DRIVE_UNITS = {"rated_torque": "Nm", **_COMMON_UNITS}
_ENCODER_UNITS = {"measuring_range": "1", **_COMMON_UNITS}
_BUS_UNITS = {"bit_rate": "bit/s", "cycle_period": "s"}
_MASTER_UNITS = dict.fromkeys(
    ("heartbeat_period", "boot_timeout", "sdo_timeout", "sample_timeout", "state_timeout"), "s"
)
_NEEDED = {
    PdoDirection.RECEIVE: {True: (0x6040, 0x6071), False: ()},
    PdoDirection.TRANSMIT: {True: (0x6041, 0x6077, 0x6064), False: (0x6004,)},
}
"""Objects that the cyclic path needs: direction -> is it a drive -> indices."""

_STRUCT_CODES = {0x02: "b", 0x03: "h", 0x04: "i", 0x05: "B", 0x06: "H", 0x07: "I", 0x15: "q", 0x1B: "Q"}
"""CiA 301 data types that a PDO of ours may carry -> `struct` code."""


def load_network(path: Path = DEFAULT_NETWORK) -> Network:
    """Read a network file and the EDS files it names.

    Raises:
        DataFileError: a file is missing or malformed, a role or node id is missing or doubled, or a PDO
            cannot be.
    """
    document = read_toml(path)
    bus = _read_positive(document, "bus", _BUS_UNITS, path, f"{path}: bus")
    master = require_table(document, "master", path)
    times = _read_positive(master, "times", _MASTER_UNITS, path, f"{path}: master.times")
    devices = require_table(document, "devices", path)
    nodes = tuple(_read_node(entry, devices, path) for entry in document.get("nodes", ()))
    check_complete(nodes, path)
    network = Network(
        name=str(document.get("name", path.stem)),
        path=path,
        bit_rate=bus["bit_rate"].value,
        cycle_period=bus["cycle_period"].value,
        master_id=_read_integer(master, "node_id", 1, 127, f"{path}: master"),
        sync_cob_id=_read_integer(master, "sync_cob_id", 1, 0x7FF, f"{path}: master"),
        times={name: quantity.value for name, quantity in times.items()},
        nodes=nodes,
    )
    check_network(network)
    return network


def _read_positive(
    parent: Mapping[str, Any], name: str, units: Mapping[str, str], path: Path, where: str
) -> dict[str, Quantity]:
    quantities = read_quantities(require_table(parent, name, path), units, where)
    check_positive({key: quantity.value for key, quantity in quantities.items()}, where)
    return quantities


def _read_integer(table: Mapping[str, Any], name: str, low: int, high: int, where: str) -> int:
    value = table.get(name)
    if not isinstance(value, int) or not low <= value <= high:
        raise DataFileError(f"{where}: {name} is {value!r}.", f"Give an integer from {low} to {high}.")
    return value


def _read_node(entry: Mapping[str, Any], devices: Mapping[str, Any], path: Path) -> Node:
    where = f"{path}: node {entry.get('id')}"
    try:
        role = Role(entry.get("role", ""))
    except ValueError as error:
        raise DataFileError(f"{where} has role {entry.get('role')!r}.", f"Use one of {', '.join(Role)}.") from error
    device = require_table(devices, str(entry.get("device")), path)
    node_id = _read_integer(entry, "id", 1, 127, where)
    eds = path.parent / str(device.get("eds"))
    dictionary = _read_eds(eds, node_id)
    rotation = _read_integer(entry, "rotation", -1, 1, where)
    if rotation == 0:
        raise DataFileError(f"{where}: rotation is 0.", "Give +1 or -1.")
    units = _DRIVE_UNITS if role in DRIVES else _ENCODER_UNITS
    pdos = tuple(_read_pdo(pdo, dictionary, where) for pdo in device.get("pdos", ()))
    _check_needed(pdos, role, where)
    return Node(
        node_id=node_id,
        role=role,
        eds=eds,
        object_dictionary=dictionary,
        identity=_read_identity(device, where),
        rotation=rotation,
        zero_counts=_read_integer(entry, "zero_counts", -(2**31), 2**32 - 1, where),
        quantities=_read_positive(device, "quantities", units, path, where),
        pdos=pdos,
    )


def _read_eds(path: Path, node_id: int) -> canopen.ObjectDictionary:
    try:
        return _parse(path.suffix, path.read_bytes(), node_id)
    except OSError as error:
        raise DataFileError(f"{path} cannot be read: {error}.", "Name an existing EDS file.") from error
    except (ValueError, KeyError) as error:
        raise DataFileError(f"{path} is not an EDS file: {error}.", "Check it with an EDS editor.") from error


@lru_cache(maxsize=64)
def _parse(suffix: str, content: bytes, node_id: int) -> canopen.ObjectDictionary:
    # Parsing takes longer than all the rest of a network file; the result is only read, and new content is parsed anew.
    file = io.StringIO(content.decode(), newline=None)
    file.name = f"dictionary{suffix}"
    return canopen.import_od(file, node_id=node_id)


def _read_identity(device: Mapping[str, Any], where: str) -> Identity:
    table = device.get("identity", {})
    names = Identity.__dataclass_fields__
    return Identity(**{name: _read_integer(table, name, 0, 2**32 - 1, f"{where}, identity") for name in names})


def _read_pdo(entry: Mapping[str, Any], dictionary: canopen.ObjectDictionary, where: str) -> Pdo:
    if entry.get("direction") not in tuple(PdoDirection):
        raise DataFileError(
            f"{where}: a PDO has direction {entry.get('direction')!r}.", f"Use one of {', '.join(PdoDirection)}."
        )
    pdo = Pdo(
        direction=PdoDirection(entry["direction"]),
        number=_read_integer(entry, "number", 1, 4, where),
        transmission_type=_read_integer(entry, "transmission_type", 1, 240, where),
        objects=tuple(_read_object(item, dictionary, where) for item in entry.get("objects", ())),
    )
    if sum(item.bits for item in pdo.objects) > 64:
        raise DataFileError(f"{where}: PDO {pdo.number} is longer than 8 bytes.", "Split it into two PDOs.")
    return pdo


def _read_object(item: Mapping[str, Any], dictionary: canopen.ObjectDictionary, where: str) -> MappedObject:
    index = _read_integer(item, "index", 0x1000, 0xFFFF, f"{where}, PDO object {item.get('name')!r}")
    subindex = _read_integer({"subindex": 0, **item}, "subindex", 0, 0xFF, f"{where}, {index:04X}h")
    variable = dictionary.get_variable(index, subindex)
    if variable is None or variable.data_type not in _STRUCT_CODES or not variable.pdo_mappable:
        raise DataFileError(f"{where}: {index:04X}h:{subindex} cannot be mapped.", "Choose from the EDS file.")
    if variable.name != item.get("name"):
        raise DataFileError(
            f"{where}: {index:04X}h:{subindex} is {variable.name!r} in the EDS file, not {item.get('name')!r}.",
            "Make name and index agree.",
        )
    return MappedObject(variable.name, index, subindex, _STRUCT_CODES[variable.data_type], len(variable))


def _check_needed(pdos: Sequence[Pdo], role: Role, where: str) -> None:
    for direction, needed in _NEEDED.items():
        mapped = {item.index for pdo in pdos if pdo.direction is direction for item in pdo.objects}
        missing = [index for index in needed[role in DRIVES] if index not in mapped]
        if missing:
            raise DataFileError(
                f"{where}: no {direction} PDO carries {', '.join(f'{index:04X}h' for index in missing)}.",
                "Add it to [[devices.<device>.pdos]].",
            )

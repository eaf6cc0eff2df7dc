"""Reader of the network file and of the EDS files it names."""

from __future__ import annotations

import configparser
import io
import re
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import canopen

from hil.network.checks import check_complete, check_network, check_positive
from hil.network.cia import HIGHEST_CAN_ID, DataType, Index
from hil.network.description import DRIVES, Identity, MappedObject, Network, Node, Pdo, PdoDirection, Role
from ident.errors import DataFileError
from ident.reading import PARSER_ERRORS, read_text
from ident.vehicle.quantities import Quantity, read_quantities, read_toml, refuse_unknown, require_table

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
_OF_THE_VEHICLE = ("gear_ratio", "rated_torque")
"""Quantities of a device that the vehicle file owns: a network file may leave them out."""

_KEYS = {
    "file": ("name", "description", "bus", "master", "devices", "nodes"),
    "master": ("node_id", "sync_cob_id", "times"),
    "device": ("eds", "identity", "quantities", "pdos"),
    "pdo": ("direction", "number", "transmission_type", "objects"),
    "object": ("name", "index", "subindex"),
    "node": ("id", "role", "device", "rotation", "zero_counts"),
}
"""What each level of a network file may hold."""

_NEEDED = {
    PdoDirection.RECEIVE: {True: (Index.CONTROLWORD, Index.TARGET_TORQUE), False: ()},
    PdoDirection.TRANSMIT: {
        True: (Index.STATUSWORD, Index.TORQUE_ACTUAL, Index.POSITION_ACTUAL),
        False: (Index.ENCODER_POSITION,),
    },
}
"""Objects that the cyclic path needs: direction -> is it a drive -> indices."""

_STRUCT_CODES: Mapping[int, str] = {
    DataType.INTEGER8: "b",
    DataType.INTEGER16: "h",
    DataType.INTEGER32: "i",
    DataType.UNSIGNED8: "B",
    DataType.UNSIGNED16: "H",
    DataType.UNSIGNED32: "I",
    DataType.INTEGER64: "q",
    DataType.UNSIGNED64: "Q",
}
"""CiA 301 data types that a PDO of ours may carry -> `struct` code."""


_ENTRIES = re.compile(r"^\s*NrOfEntries\s*=\s*(\d+)", re.IGNORECASE | re.MULTILINE)
_SUBINDICES = 254
_DEVICE_INFO = re.compile(r"^\s*\[DeviceInfo\]", re.IGNORECASE | re.MULTILINE)


def network_file_of(vehicle: str) -> Path:
    """The network file of a vehicle: beside its own file, or that shipped under the name of the vehicle or its file.

    Beside `my_vehicle.toml` lies `my_vehicle.network.toml`; beside the vehicle file of a run folder, the folder's own.
    """
    beside = (Path(vehicle).with_suffix(".network.toml"), Path(vehicle).parent / "network" / "network.toml")
    if Path(vehicle).suffix:
        for path in beside:
            if path.is_file():
                return path
    shipped = DEFAULT_NETWORK.with_name(f"{Path(vehicle).stem}.toml")
    return shipped if shipped.is_file() else DEFAULT_NETWORK


def load_network(path: Path = DEFAULT_NETWORK) -> Network:
    """Read a network file and the EDS files it names.

    Raises:
        DataFileError: a file is missing or malformed, a role or node id is missing or doubled, or a PDO
            cannot be.
    """
    document = read_toml(path)
    refuse_unknown(document, _KEYS["file"], f"{path}:")
    bus = _read_positive(document, "bus", _BUS_UNITS, path, f"{path}: bus")
    master = require_table(document, "master", path)
    refuse_unknown(master, _KEYS["master"], f"{path}: master")
    times = _read_positive(master, "times", _MASTER_UNITS, path, f"{path}: master.times")
    devices = require_table(document, "devices", path)
    _check_devices(devices, path)
    nodes = tuple(_read_node(entry, devices, path) for entry in _tables(document, "nodes", f"{path}:"))
    check_complete(nodes, path)
    network = Network(
        name=str(document.get("name", path.stem)),
        path=path,
        bit_rate=bus["bit_rate"].value,
        cycle_period=bus["cycle_period"].value,
        master_id=_read_integer(master, "node_id", 1, 127, f"{path}: master"),
        sync_cob_id=_read_integer(master, "sync_cob_id", 1, HIGHEST_CAN_ID, f"{path}: master"),
        times={name: quantity.value for name, quantity in times.items()},
        nodes=nodes,
    )
    check_network(network)
    return network


def _check_devices(devices: Mapping[str, Any], path: Path) -> None:
    """Refuse keys that nobody reads, in devices that no node uses too."""
    for name in devices:
        device, where = require_table(devices, name, path), f"{path}: devices.{name}"
        refuse_unknown(device, _KEYS["device"], where)
        for pdo in _tables(device, "pdos", where):
            refuse_unknown(pdo, _KEYS["pdo"], f"{where}.pdos")
            for item in _tables(pdo, "objects", f"{where}.pdos"):
                refuse_unknown(item, _KEYS["object"], f"{where}.pdos.objects")


def _tables(parent: Mapping[str, Any], name: str, where: str) -> Sequence[Mapping[str, Any]]:
    """The array of tables of that name, empty where there is none."""
    found = parent.get(name, ())
    if not isinstance(found, Sequence) or not all(isinstance(entry, Mapping) for entry in found):
        raise DataFileError(f"{where} {name} is no array of tables.", f"Write [[{name}]] ahead of each entry.")
    return found


def _read_positive(
    parent: Mapping[str, Any],
    name: str,
    units: Mapping[str, str],
    path: Path,
    where: str,
    optional: Iterable[str] = (),
) -> dict[str, Quantity]:
    quantities = read_quantities(require_table(parent, name, path), units, where, optional=optional)
    check_positive({key: quantity.value for key, quantity in quantities.items()}, where)
    return quantities


def _read_integer(table: Mapping[str, Any], name: str, low: int, high: int, where: str) -> int:
    value = table.get(name)
    if not isinstance(value, int) or not low <= value <= high:
        raise DataFileError(f"{where}: {name} is {value!r}.", f"Give an integer from {low} to {high}.")
    return value


def _read_node(entry: Mapping[str, Any], devices: Mapping[str, Any], path: Path) -> Node:
    where = f"{path}: node {entry.get('id')}"
    refuse_unknown(entry, _KEYS["node"], where)
    try:
        role = Role(entry.get("role", ""))
    except ValueError as error:
        raise DataFileError(f"{where} has role {entry.get('role')!r}.", f"Use one of {', '.join(Role)}.") from error
    device = require_table(devices, str(entry.get("device")), path)
    node_id = _read_integer(entry, "id", 1, 127, where)
    eds = path.parent / str(device.get("eds"))
    dictionary = read_eds(eds, node_id)
    rotation = _read_integer(entry, "rotation", -1, 1, where)
    if rotation == 0:
        raise DataFileError(f"{where}: rotation is 0.", "Give +1 or -1.")
    units, left_out = (_DRIVE_UNITS, _OF_THE_VEHICLE) if role in DRIVES else (_ENCODER_UNITS, ())
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
        quantities=_read_positive(device, "quantities", units, path, where, left_out),
        device=str(entry["device"]),
        pdos=pdos,
    )


def read_eds(path: Path, node_id: int) -> canopen.ObjectDictionary:
    """The object dictionary of an EDS file.

    Raises:
        DataFileError: it cannot be read, or is none.
    """
    content = read_text(path)
    try:
        return _parse(path.suffix, content, node_id)
    except (configparser.Error, *PARSER_ERRORS) as error:
        raise DataFileError(f"{path} is not an EDS file: {error}.", "Check it with an EDS editor.") from error


@lru_cache(maxsize=64)
def _parse(suffix: str, content: str, node_id: int) -> canopen.ObjectDictionary:
    # Parsing takes longer than all the rest of a network file; the result is only read, and new content is parsed anew.
    for number in _ENTRIES.findall(content):
        # canopen makes as many subindices as are asked for, and there are no more than these.
        if int(number) > _SUBINDICES:
            raise ValueError(f"NrOfEntries is {number}")
    if not _DEVICE_INFO.search(content):
        # canopen goes on without it, and prints that it misses it.
        raise ValueError("it has no section [DeviceInfo]")
    file = io.StringIO(content, newline=None)
    file.name = f"dictionary{suffix}"
    return canopen.import_od(file, node_id=node_id)


def _read_identity(device: Mapping[str, Any], where: str) -> Identity:
    table = device.get("identity")
    if not isinstance(table, Mapping):
        raise DataFileError(f"{where}: its device has no identity.", "Write identity = { device_type = ..., ... }.")
    names = Identity.__dataclass_fields__
    refuse_unknown(table, names, f"{where}, identity")
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
    index = _read_integer(item, "index", Index.DEVICE_TYPE, 0xFFFF, f"{where}, PDO object {item.get('name')!r}")
    subindex = _read_integer({"subindex": 0, **item}, "subindex", 0, 0xFF, f"{where}, {index:04X}h")
    variable = dictionary.get_variable(index, subindex)
    code = None if variable is None else _STRUCT_CODES.get(variable.data_type or 0)
    if variable is None or code is None or not variable.pdo_mappable:
        raise DataFileError(f"{where}: {index:04X}h:{subindex} cannot be mapped.", "Choose from the EDS file.")
    if variable.name != item.get("name"):
        raise DataFileError(
            f"{where}: {index:04X}h:{subindex} is {variable.name!r} in the EDS file, not {item.get('name')!r}.",
            "Make name and index agree.",
        )
    return MappedObject(variable.name, index, subindex, code, len(variable))


def _check_needed(pdos: Sequence[Pdo], role: Role, where: str) -> None:
    for direction, needed in _NEEDED.items():
        mapped = {item.index for pdo in pdos if pdo.direction is direction for item in pdo.objects}
        missing = [index for index in needed[role in DRIVES] if index not in mapped]
        if missing:
            raise DataFileError(
                f"{where}: no {direction} PDO carries {', '.join(f'{index:04X}h' for index in missing)}.",
                "Add it to [[devices.<device>.pdos]].",
            )

"""The files that a run folder carries with it, so that it can be read wherever it is taken.

A network file names EDS files, by any path that its author liked. Where all of them lie beside the network file or
below it, everything is carried byte for byte, in the same folders. Where one lies elsewhere, all EDS files are put into
a folder of their own, under the names of their devices, and the carried network file names them there; its comments
and its layout stay.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import Any, Final

import canopen
import numpy as np

from hil.network import Network
from hil.network.described import load_described
from ident.errors import CampaignError, DataFileError
from ident.vehicle.description import VehicleDescription, load_vehicle
from ident.vehicle.quantities import Quantity, read_toml
from ident.writing import write_whole

VEHICLE_FILE: Final = "vehicle.toml"
SIMULATOR_FILE: Final = "simulator.toml"
NETWORK_FILE: Final = "network.toml"
_EDS_FOLDER: Final = "eds"
_NONE: Final = canopen.import_od(None)

Files = Mapping[str, bytes]
"""Content by path inside a folder, with slashes."""


def carried_network(path: Path) -> Files:
    """The network file and its EDS files as they are put into one folder; carried again, they are the same.

    Raises:
        DataFileError: one of them cannot be read.
    """
    named = _named_eds(read_toml(path))
    if all(_stays_inside(eds) for eds in named.values()):
        return {NETWORK_FILE: _read(path), **{eds: _read(path.parent / eds) for eds in named.values()}}
    places = _places(named)
    return {
        NETWORK_FILE: _renamed(_read(path), places),
        **{place: _read(path.parent / named[device]) for device, place in places.items()},
    }


def carried_vehicle(path: Path) -> Files:
    """The vehicle file as it is put into a run folder.

    Raises:
        DataFileError: it cannot be read.
    """
    return {VEHICLE_FILE: _read(path)}


def carried_simulator(path: Path) -> Files:
    """The model that an emulated vehicle is made from, as it is put into a run folder.

    Raises:
        DataFileError: it cannot be read.
    """
    return {SIMULATOR_FILE: _read(path)}


def write_carried(files: Files, folder: Path, *, replace: bool = False) -> None:
    """Put files into a folder, each whole and on the disk; those that are there with this content stay.

    Args:
        files: content by path inside the folder.
        folder: made if missing.
        replace: other files of these names go.

    Raises:
        CampaignError: a file of that name is there with other content, which is left as it is.
        UserError: a file cannot be written.
    """
    if not replace:
        refuse_others(files, folder)
    for name, content in files.items():
        if replace or not (folder / name).exists():
            write_whole(content, folder / name)


def refuse_others(files: Files, folder: Path) -> None:
    """Refuse a folder that has other files of these names; those of a campaign that was killed at once are the same.

    Raises:
        CampaignError: a file of that name is there with other content.
    """
    for name, content in files.items():
        path = folder / name
        if path.exists() and not (path.is_file() and path.read_bytes() == content):
            raise CampaignError(f"{path} is there, and is not this campaign's.", "Name another folder (--out).")


def is_carried(files: Files, folder: Path) -> bool:
    """Whether the files are in a folder with just this content."""
    return all((folder / name).is_file() and (folder / name).read_bytes() == files[name] for name in files)


def check_readable(vehicle_file: Path, network_file: Path, vehicle: VehicleDescription, network: Network) -> None:
    """See that what was carried reads as what was planned with; a file may have changed since it was read.

    Raises:
        CampaignError: it does not.
        DataFileError: it cannot be read.
    """
    if not _same_vehicle(load_vehicle(vehicle_file), vehicle):
        raise _changed(vehicle_file)
    if _essence(load_described(vehicle_file, network_file).network) != _essence(network):
        raise _changed(network_file)


def _changed(path: Path) -> CampaignError:
    return CampaignError(
        f"{path} does not say what the campaign was planned with: its source has been changed meanwhile.",
        "Plan again, into another folder (--out).",
    )


def _named_eds(document: Mapping[str, Any]) -> dict[str, str]:
    """Paths of the EDS files by the device that they are of; devices that no node has may name what they like."""
    used = [str(node["device"]) for node in document["nodes"]]
    return {name: str(document["devices"][name]["eds"]) for name in dict.fromkeys(used)}


def _stays_inside(eds: str) -> bool:
    path = PurePosixPath(eds)
    is_plain = not path.is_absolute() and ".." not in path.parts and "\\" not in eds
    return is_plain and str(path) == eds and eds != NETWORK_FILE


def _places(named: Mapping[str, str]) -> dict[str, str]:
    """Where the EDS file of each device is put: under a number and the device's name, whatever letters that has."""
    return {
        device: f"{_EDS_FOLDER}/{number}_{_plain(device)}{Path(eds).suffix}"
        for number, (device, eds) in enumerate(named.items(), start=1)
    }


def _plain(name: str) -> str:
    return "".join(letter if letter.isascii() and letter.isalnum() else "_" for letter in name)[:50]


def _renamed(content: bytes, places: Mapping[str, str]) -> bytes:
    import tomlkit  # keeps comments and layout; few network files need it

    document: Any = tomlkit.parse(content.decode("utf-8-sig"))
    for device, place in places.items():
        document["devices"][device]["eds"] = place
    return tomlkit.dumps(document).encode()


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise DataFileError(f"{path} cannot be read: {error.strerror}.", "Name a file that can be read.") from error


def _essence(network: Network) -> Network:
    """The network without where its files lie and its numbers come from; one without a name is called like its file."""
    nodes = tuple(
        dataclasses.replace(node, eds=Path(), object_dictionary=_NONE, quantities=_without_sources(node.quantities))
        for node in network.nodes
    )
    return dataclasses.replace(network, name="", path=Path(), nodes=nodes)


def _without_sources(quantities: Mapping[str, Quantity]) -> dict[str, Quantity]:
    return {name: dataclasses.replace(quantity, source="") for name, quantity in quantities.items()}


def _same_vehicle(one: VehicleDescription, other: VehicleDescription) -> bool:
    return (
        (one.geometry, one.limits) == (other.geometry, other.limits)
        and np.array_equal(one.prior.values, other.prior.values)
        and np.array_equal(one.prior.std, other.prior.std)
    )

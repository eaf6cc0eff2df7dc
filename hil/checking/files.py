"""Files of any kind, sorted by what they are and checked against each other."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Any, Final, TypeVar

from hil.campaign.folder import RunFolder, describe, open_run
from hil.campaign.reading import read_any, read_driven, whole_records
from hil.checking.findings import Finding, Severity, unreadable
from hil.checking.records import check_records
from hil.checking.vehicle import check_agreement, check_rehearsal, check_vehicle
from hil.network import Network, load_network, network_file_of
from hil.network.described import Described, differences, load_described
from hil.network.reader import read_eds
from ident.errors import DataFileError, RecordError, UserError
from ident.records.record import Record
from ident.vehicle.description import VehicleDescription, load_vehicle
from ident.vehicle.quantities import read_toml

T = TypeVar("T")

SCHEMA: Final = "quasiomni.check/1"


class FileKind(StrEnum):
    """What a file is."""

    VEHICLE = "vehicle"
    NETWORK = "network"
    EDS = "eds"
    RUN = "run"
    RECORD = "record"


class Verdict(StrEnum):
    """The outcome of a check."""

    FITS = "fits"
    DOES_NOT_FIT = "does_not_fit"
    UNREADABLE = "unreadable"


@dataclass
class Checked:
    """What was checked, and what was found.

    Attributes:
        files: with their kinds, in the order given; those found beside a vehicle file after them.
        findings: in the order found.
        beside: the network file that was not given, but found for the vehicle file.
    """

    files: dict[Path, FileKind] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)
    beside: Path | None = None

    @property
    def verdict(self) -> Verdict:
        """Whether the files belong together."""
        found = {finding.severity for finding in self.findings}
        if Severity.UNREADABLE in found:
            return Verdict.UNREADABLE
        return Verdict.DOES_NOT_FIT if Severity.ERROR in found else Verdict.FITS

    def to_json(self) -> dict[str, Any]:
        """As plain values."""
        return {
            "schema": SCHEMA,
            "verdict": self.verdict.value,
            "files": [{"path": str(path), "kind": kind.value} for path, kind in self.files.items()],
            "findings": [finding.to_json() for finding in self.findings],
            "faults": [finding.fault.as_json() for finding in self.findings if finding.fault is not None],
        }

    def of(self, kind: FileKind) -> list[Path]:
        """The files of a kind."""
        return [path for path, found in self.files.items() if found is kind]


def check_files(paths: Sequence[Path]) -> Checked:
    """Say whether files belong together. What cannot be read is a finding too, so nothing is raised for a file.

    Args:
        paths: vehicle file, network file, EDS files, run folders, logs and records, in any order.

    Raises:
        DataFileError: two vehicles, or two networks, are given.
    """
    checked = Checked()
    for path in paths:
        _guard(checked, path, partial(_sort, checked, path))
    if checked.verdict is not Verdict.UNREADABLE:
        _check_sorted(checked)
    return checked


def _guard(checked: Checked, path: Path, work: Callable[[], T]) -> T | None:
    """What some work on a file gives; None where the file is unreadable, which is a finding."""
    try:
        return work()
    except UserError as error:
        checked.findings.append(unreadable(str(path), error))
        return None


def _loaded(checked: Checked, paths: Sequence[Path], load: Callable[[Path], T]) -> T | None:
    """What is in the only file of a kind, None where there is none or it is unreadable."""
    return _guard(checked, paths[0], partial(load, paths[0])) if paths else None


def _sort(checked: Checked, path: Path) -> None:
    if not path.exists():
        raise DataFileError(f"{path} does not exist.", "Name an existing file or folder.")
    checked.files[path] = _kind_of(path)


def _kind_of(path: Path) -> FileKind:
    if RunFolder(path).manifest.is_file():
        return FileKind.RUN
    if path.suffix in (".eds", ".dcf"):
        return FileKind.EDS
    if path.suffix != ".toml":
        return FileKind.RECORD
    document = read_toml(path)
    if {"nodes", "devices", "bus"} & document.keys():
        return FileKind.NETWORK
    if {"geometry", "prior", "limits"} & document.keys() and "truth" not in document:
        return FileKind.VEHICLE
    raise DataFileError(
        f"{path} is neither a vehicle file nor a network file.",
        "A vehicle file has [geometry], [prior] and [limits], a network file [bus], [devices] and [[nodes]].",
    )


def _check_sorted(checked: Checked) -> None:
    for kind in (FileKind.VEHICLE, FileKind.NETWORK):
        several = checked.of(kind)
        if len(several) > 1:
            raise DataFileError(f"{several[0]} and {several[1]} are both {kind} files.", "Check one vehicle at a time.")
    described = _check_description(checked)
    for path in checked.of(FileKind.EDS):
        _guard(checked, path, partial(read_eds, path, 1))
    for path in checked.of(FileKind.RUN):
        _guard(checked, path, partial(_check_run, checked, path))
    _check_records(checked, described)


def _check_description(checked: Checked) -> Described | None:
    """The vehicle by the vehicle and network files among those given, None where they do not make one."""
    vehicles, networks = checked.of(FileKind.VEHICLE), checked.of(FileKind.NETWORK)
    if vehicles and not networks:
        networks = [network_file_of(str(vehicles[0]))]
        checked.beside = networks[0]
        checked.files[networks[0]] = FileKind.NETWORK
    vehicle = _loaded(checked, vehicles, load_vehicle)
    network = _loaded(checked, networks, load_network)
    checked.findings += _of_description(vehicle, network)
    _check_named_eds(checked, network)
    if vehicle is None or network is None or checked.verdict is not Verdict.FITS:
        return None
    described = load_described(vehicles[0], networks[0])
    checked.findings += check_rehearsal(described)
    return described


def _of_description(vehicle: VehicleDescription | None, network: Network | None) -> Iterator[Finding]:
    if vehicle is not None:
        yield from check_vehicle(vehicle)
    if network is not None:
        yield from check_agreement(vehicle, network)


def _check_named_eds(checked: Checked, network: Network | None) -> None:
    """EDS files that are given are those of the network."""
    if network is None:
        return
    named = {node.eds.resolve() for node in network.nodes}
    for path in checked.of(FileKind.EDS):
        if path.resolve() not in named:
            checked.findings.append(
                Finding(
                    Severity.ERROR,
                    "eds_not_named",
                    str(path),
                    f"No device of {network.path} names {path}.",
                    "Name it there (eds = ...), or leave it out.",
                )
            )


def _check_run(checked: Checked, path: Path) -> None:
    """A run by its own files, or by those that are given in their place."""
    folder = RunFolder(path)
    own = load_vehicle(folder.vehicle)
    vehicles = checked.of(FileKind.VEHICLE)
    # Frames are those of the run's own network, unless another one is named.
    networks = [network for network in checked.of(FileKind.NETWORK) if network != checked.beside]
    for given in vehicles:
        checked.findings += _other_vehicle(path, own, load_vehicle(given))
    taken = load_vehicle(vehicles[0]) if vehicles else own
    found = list(check_agreement(taken, load_network(networks[0] if networks else folder.network)))
    checked.findings += [finding for finding in found if finding not in checked.findings]
    if any(finding.severity is Severity.ERROR for finding in found):
        return
    run = open_run(path)
    described = describe(run, str(vehicles[0]) if vehicles else None, networks[0] if networks else None)
    checked.findings += check_records(read_driven(replace(run, network=described.network)), described)


def _other_vehicle(path: Path, own: VehicleDescription, given: VehicleDescription) -> Iterator[Finding]:
    changed = differences(own, given)
    if changed:
        yield Finding(
            Severity.ERROR,
            "other_vehicle",
            str(given.path),
            f"It is not the vehicle that {path} was driven with: {'; '.join(changed)}.",
            f"Correct whichever is wrong; the run was driven by {own.path}.",
        )


def _check_records(checked: Checked, described: Described | None) -> None:
    """Records that are no run folders; the logs of one campaign are checked as one."""
    paths = checked.of(FileKind.RECORD)
    if not paths or (described is None and checked.of(FileKind.VEHICLE)):
        # What is wrong with the vehicle has been found already.
        return
    taken = described or _assumed_vehicle(checked, paths[0])
    if taken is None:
        return
    read: list[Record] = []
    for path in paths:
        _guard(checked, path, partial(_add_record, read, path, taken))
    for record in whole_records(read):
        checked.findings += check_records(record, taken)


def _assumed_vehicle(checked: Checked, path: Path) -> Described | None:
    """The prototype, where no vehicle file is given; None where a network that is given is not the prototype's."""
    networks = checked.of(FileKind.NETWORK)
    if networks:
        found = list(check_agreement(load_vehicle(), load_network(networks[0])))
        if any(finding.severity is Severity.ERROR for finding in found):
            text = f"{path} is of no known vehicle: {networks[0]} is not of the prototype."
            remedy = "Name the vehicle file too."
            checked.findings.append(Finding(Severity.ERROR, "no_vehicle", str(path), text, remedy))
            return None
    described = describe(None, None, networks[0] if networks else None)
    text = f"No vehicle file is given: {path} is taken as a record of {described.vehicle.name}."
    checked.findings.append(Finding(Severity.ASSUMED, "vehicle", str(path), text))
    return described


def _add_record(read: list[Record], path: Path, described: Described) -> None:
    try:
        read.append(read_any(path, described.network))
    except OSError as error:
        raise RecordError(f"{path} cannot be read: {error}.", "Name a readable record.") from error

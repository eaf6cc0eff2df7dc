"""Vehicle records in files: CSV, Parquet, ASAM MDF 4 and MCAP, chosen by the file's ending."""

from __future__ import annotations

from pathlib import Path

from ident.errors import RecordError
from ident.records.channels import Channels, read_channels, write_channels
from ident.records.record import Record
from ident.records.table import CHANNEL_UNITS, record_from_table, table_from_record


def read_record(path: Path) -> Record:
    """Read a vehicle record: the channels of `ident.records.record`.

    Raises:
        RecordError: the file is missing, of unknown kind, unreadable, or breaks the contract.
    """
    channels = read_channels(path)
    for name, unit in channels.units.items():
        _check_unit(path, name, unit)
    return record_from_table(channels.values, str(path))


def write_record(record: Record, path: Path) -> None:
    """Write a record; CSV implies SI units, the others state them.

    Raises:
        RecordError: the file's ending is unknown.
    """
    table = table_from_record(record)
    write_channels(Channels(table, {name: CHANNEL_UNITS.get(name, "") for name in table}), path)


def _check_unit(path: Path, name: str, unit: str) -> None:
    expected = CHANNEL_UNITS.get(name)
    if expected is not None and unit != expected:
        raise RecordError(
            f"{path}: channel {name} is in {unit!r}.", f"Convert it to {expected!r}: records are in SI units."
        )

"""Records in files: CSV, Parquet and ASAM MDF 4, chosen by the file's ending."""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ident.errors import RecordError
from ident.records.record import Record
from ident.records.table import CHANNEL_UNITS, record_from_table, table_from_record


def read_record(path: Path) -> Record:
    """Read a record of design section 6.

    Raises:
        RecordError: the file is missing, of unknown kind, unreadable, or breaks the contract.
    """
    reader = _lookup(path, _READERS)
    if not path.is_file():
        raise RecordError(f"{path} does not exist.", "Name an existing record.")
    return record_from_table(reader(path), str(path))


def write_record(record: Record, path: Path) -> None:
    """Write a record; CSV implies SI units, Parquet and MF4 state them.

    Raises:
        RecordError: the file's ending is unknown.
    """
    _lookup(path, _WRITERS)(table_from_record(record), path)


def _lookup(path: Path, table: Mapping[str, Any]) -> Callable[..., Any]:
    try:
        function: Callable[..., Any] = table[path.suffix.lower()]
    except KeyError:
        raise RecordError(
            f"{path} ends in {path.suffix!r}, which is no kind of record.", f"Use {', '.join(table)}."
        ) from None
    return function


def _require_extra(module: str, path: Path) -> Any:
    try:
        return __import__(module)
    except ImportError as error:
        raise RecordError(
            f"{path} needs the package {module}.", "Install it: pip install 'quasiomni[records]'."
        ) from error


def _read_csv(path: Path) -> dict[str, NDArray[Any]]:
    with path.open(newline="", encoding="utf-8") as file:
        try:
            header, *rows = csv.reader(file)
        except (ValueError, UnicodeDecodeError) as error:
            raise RecordError(f"{path} is not a CSV file with a header line.", "Write one.") from error
    names = [name.strip() for name in header]
    for number, row in enumerate(rows):
        if len(row) != len(names):
            raise RecordError(
                f"{path}, line {number + 2}: {len(row)} fields where the header has {len(names)}.",
                "The file may be cut off; remove the line or record again.",
            )
    columns = zip(*rows, strict=True) if rows else ([] for _ in names)
    return {name: _csv_column(path, name, list(cells)) for name, cells in zip(names, columns, strict=True)}


def _csv_column(path: Path, name: str, cells: list[str]) -> NDArray[Any]:
    if name == "step":
        return np.array(cells)
    try:
        return np.array(cells, dtype=float)
    except ValueError as error:
        raise RecordError(f"{path}: channel {name}: {error}.", "Write numbers with a decimal point.") from error


def _write_csv(table: Mapping[str, NDArray[Any]], path: Path) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(table)
        writer.writerows(zip(*(values.tolist() for values in table.values()), strict=True))


def _read_parquet(path: Path) -> dict[str, NDArray[Any]]:
    _require_extra("pyarrow", path)
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        table = pq.read_table(path)
    except pa.ArrowException as error:
        raise RecordError(f"{path} is not a readable Parquet file: {error}.", "Record again.") from error
    for entry in table.schema:
        unit = (entry.metadata or {}).get(b"unit")
        if unit is not None:
            _check_unit(path, entry.name, unit.decode())
    return {name: table.column(name).to_numpy() for name in table.column_names}


def _write_parquet(table: Mapping[str, NDArray[Any]], path: Path) -> None:
    _require_extra("pyarrow", path)
    import pyarrow as pa
    import pyarrow.parquet as pq

    arrays = [pa.array(values) for values in table.values()]
    fields = [
        pa.field(name, array.type, metadata={"unit": CHANNEL_UNITS.get(name, "")})
        for name, array in zip(table, arrays, strict=True)
    ]
    pq.write_table(pa.table(arrays, schema=pa.schema(fields)), path)


def _check_unit(path: Path, name: str, unit: str) -> None:
    expected = CHANNEL_UNITS.get(name)
    if expected is not None and unit != expected:
        raise RecordError(
            f"{path}: channel {name} is in {unit!r}.", f"Convert it to {expected!r}: records are in SI units."
        )


def _read_mf4(path: Path) -> dict[str, NDArray[Any]]:
    _require_extra("asammdf", path)
    from asammdf import MDF
    from asammdf.blocks.utils import MdfException

    try:
        with MDF(path) as mdf:
            signals = list(mdf.iter_channels(skip_master=True))
    except (MdfException, OSError, ValueError) as error:
        raise RecordError(f"{path} is not a readable MF4 file: {error}.", "Record again.") from error
    if not signals:
        raise RecordError(f"{path} holds no channels.", "Record again.")
    table: dict[str, NDArray[Any]] = {"time": np.asarray(signals[0].timestamps, dtype=float)}
    for signal in signals:
        if len(signal.timestamps) != len(table["time"]):
            raise RecordError(f"{path}: channel {signal.name} is sampled at another rate.", "Resample to one raster.")
        if signal.unit:
            _check_unit(path, signal.name, signal.unit)
        table[signal.name] = np.asarray(signal.samples)
    if "step" in table:
        table["step"] = np.array([_text(value) for value in table["step"]])
    return table


def _text(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)


def _write_mf4(table: Mapping[str, NDArray[Any]], path: Path) -> None:
    _require_extra("asammdf", path)
    from asammdf import MDF, Signal

    signals = [
        Signal(
            samples=np.char.encode(values, "utf-8") if name == "step" else values,
            timestamps=table["time"],
            name=name,
            unit=CHANNEL_UNITS.get(name, ""),
            **({"encoding": "utf-8"} if name == "step" else {}),
        )
        for name, values in table.items()
        if name != "time"
    ]
    with MDF(version="4.10") as mdf:
        mdf.append(signals, comment="quasiomni record")
        mdf.save(path, overwrite=True)


_READERS: Final = {".csv": _read_csv, ".parquet": _read_parquet, ".mf4": _read_mf4}
_WRITERS: Final = {".csv": _write_csv, ".parquet": _write_parquet, ".mf4": _write_mf4}

"""Named channels in files: CSV, Parquet and ASAM MDF 4, chosen by the file's ending, whatever they describe."""

from __future__ import annotations

import csv
import gc
import importlib
import struct
import sys
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from ident.errors import RecordError

Values = Mapping[str, NDArray[Any]]
Handler = TypeVar("Handler")

TEXT_CHANNELS: Final = ("step",)
"""Channels of a CSV file that hold words even where they look like numbers."""
OTHER_SEPARATORS: Final = ";\t"
"""What spreadsheets of other countries write between channels."""


@dataclass(frozen=True)
class Channels:
    """What a file holds.

    Attributes:
        values: (N,) by channel name, `time` among them where the file has one.
        units: of the channels whose unit the file states; a CSV file may state one in brackets behind the name, as in
            `position [rad]`, and implies SI where it does not.
    """

    values: Values
    units: Mapping[str, str] = field(default_factory=dict)


def read_channels(path: Path) -> Channels:
    """Read all channels of a file.

    Raises:
        RecordError: the file is missing, of unknown kind, unreadable, or its channels have several rasters.
    """
    if not path.is_file():
        raise RecordError(f"{path} does not exist or is no file.", "Name an existing record.")
    return _lookup(path, _READERS)(path)


def write_channels(channels: Channels, path: Path) -> None:
    """Write channels of one length; CSV implies SI units, Parquet and MF4 state them.

    Raises:
        RecordError: the file's ending is unknown, or a package for it is missing.
    """
    _lookup(path, _WRITERS)(channels, path)


def _lookup(path: Path, table: Mapping[str, Handler]) -> Handler:
    function = table.get(path.suffix.lower())
    if function is None:
        raise RecordError(f"{path} ends in {path.suffix!r}, which is no kind of record.", f"Use {', '.join(table)}.")
    return function


def _require_extra(module: str, path: Path) -> None:
    try:
        importlib.import_module(module)
    except ImportError as error:
        raise RecordError(
            f"{path} needs the package {module}.", "Install it: pip install 'quasiomni[records]'."
        ) from error


def _read_csv(path: Path) -> Channels:
    with path.open(newline="", encoding="utf-8-sig") as file:
        try:
            header, *rows = csv.reader(file)
        except (ValueError, csv.Error) as error:
            raise RecordError(
                f"{path} has no header line: it is empty or no CSV file.",
                "Its first line names the channels, each further line is a sample.",
            ) from error
    named = [_name_and_unit(cell) for cell in header]
    names = [name for name, _ in named]
    if len(names) == 1 and any(mark in names[0] for mark in OTHER_SEPARATORS):
        raise RecordError(
            f"{path}: the channels in its first line are not separated by commas.",
            "Separate them by commas, and write numbers with a decimal point.",
        )
    _refuse_twins(path, names)
    while rows and not any(cell.strip() for cell in rows[-1]):
        rows.pop()
    for number, row in enumerate(rows):
        if len(row) != len(names):
            raise RecordError(
                f"{path}, line {number + 2}: {len(row)} fields where the header has {len(names)}.",
                "The file may be cut off; remove the line or record again.",
            )
    columns = zip(*rows, strict=True) if rows else ([] for _ in names)
    values = {name: _csv_column(name, list(cells)) for name, cells in zip(names, columns, strict=True)}
    return Channels(values, {name: unit for name, unit in named if unit is not None})


def _name_and_unit(cell: str) -> tuple[str, str | None]:
    """`position [rad]` is a name and a unit; what has no brackets behind it is a name."""
    text = cell.strip()
    if not (text.endswith("]") and "[" in text):
        return text, None
    name, _, unit = text.removesuffix("]").rpartition("[")
    return name.strip(), unit.strip()


def _refuse_twins(path: Path, names: list[str]) -> None:
    twins = sorted({name for name in names if names.count(name) > 1})
    if twins:
        raise RecordError(f"{path} has several channels named {', '.join(twins)}.", "Give every channel its own name.")


def _csv_column(name: str, cells: list[str]) -> NDArray[Any]:
    """Numbers, or words where one is none; whoever needs numbers refuses those."""
    if name in TEXT_CHANNELS:
        return np.array(cells, dtype=str)
    try:
        return np.array(cells, dtype=float)
    except ValueError:
        return np.array(cells, dtype=str)


def _write_csv(channels: Channels, path: Path) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(channels.values)
        writer.writerows(zip(*(values.tolist() for values in channels.values.values()), strict=True))


def _read_parquet(path: Path) -> Channels:
    _require_extra("pyarrow", path)
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        table = pq.read_table(path)
    except (pa.ArrowException, OSError) as error:
        raise RecordError(f"{path} is not a readable Parquet file: {error}.", "Record again.") from error
    stated = {entry.name: (entry.metadata or {}).get(b"unit", b"").decode() for entry in table.schema}
    return Channels(
        {name: table.column(name).to_numpy() for name in table.column_names},
        {name: unit for name, unit in stated.items() if unit},
    )


def _write_parquet(channels: Channels, path: Path) -> None:
    _require_extra("pyarrow", path)
    import pyarrow as pa
    import pyarrow.parquet as pq

    arrays = [pa.array(values) for values in channels.values.values()]
    fields = [
        pa.field(name, array.type, metadata={"unit": channels.units.get(name, "")})
        for name, array in zip(channels.values, arrays, strict=True)
    ]
    pq.write_table(pa.table(arrays, schema=pa.schema(fields)), path)


def _read_mf4(path: Path) -> Channels:
    _require_extra("asammdf", path)
    from asammdf import MDF
    from asammdf.blocks.utils import MdfException

    try:
        with MDF(path) as mdf:
            signals = list(mdf.iter_channels(skip_master=True))
    except (MdfException, OSError, ValueError, struct.error) as error:
        _discard(error)
        raise RecordError(f"{path} is not a readable MF4 file: {error}.", "Record again.") from error
    if not signals:
        raise RecordError(f"{path} holds no channels.", "Record again.")
    time = np.asarray(signals[0].timestamps, dtype=float)
    for signal in signals:
        if not np.array_equal(signal.timestamps, time):
            raise RecordError(f"{path}: channel {signal.name} is sampled at another rate.", "Resample to one raster.")
    return Channels(
        {"time": time, **{signal.name: _numbers_or_text(np.asarray(signal.samples)) for signal in signals}},
        {signal.name: signal.unit for signal in signals if signal.unit},
    )


def _discard(error: BaseException) -> None:
    """Delete what a reader left half-made, silently: the destructor of asammdf fails where its constructor has."""
    hook = sys.unraisablehook
    sys.unraisablehook = lambda _: None
    try:
        traceback.clear_frames(error.__traceback__)
        gc.collect()
    finally:
        sys.unraisablehook = hook


def _numbers_or_text(samples: NDArray[Any]) -> NDArray[Any]:
    return np.char.decode(samples, "utf-8") if samples.dtype.kind == "S" else samples


def _write_mf4(channels: Channels, path: Path) -> None:
    _require_extra("asammdf", path)
    from asammdf import MDF, Signal

    signals = [
        Signal(
            samples=np.char.encode(values, "utf-8") if values.dtype.kind == "U" else values,
            timestamps=channels.values["time"],
            name=name,
            unit=channels.units.get(name, ""),
            encoding="utf-8" if values.dtype.kind == "U" else None,
        )
        for name, values in channels.values.items()
        if name != "time"
    ]
    with MDF(version="4.10") as mdf:
        mdf.append(signals, comment="quasiomni record")
        mdf.save(path, overwrite=True)


_READERS: Final[dict[str, Callable[[Path], Channels]]] = {
    ".csv": _read_csv,
    ".parquet": _read_parquet,
    ".mf4": _read_mf4,
}
_WRITERS: Final[dict[str, Callable[[Channels, Path], None]]] = {
    ".csv": _write_csv,
    ".parquet": _write_parquet,
    ".mf4": _write_mf4,
}

"""Named channels in files: CSV, Parquet, ASAM MDF 4 and MCAP, chosen by the file's ending, whatever they describe."""

from __future__ import annotations

import csv
import gc
import importlib
import io
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from ident.errors import RecordError
from ident.reading import LARGEST_RECORD, PARSER_ERRORS, refuse_unreadable
from ident.records.apart import read_apart
from ident.records.mcap_channels import read_mcap_channels, write_mcap_channels
from ident.records.mf4_blocks import check_blocks
from ident.writing import write_by

Values = Mapping[str, NDArray[Any]]
Handler = TypeVar("Handler")

TEXT_CHANNELS: Final = ("step",)
"""Channels of a CSV file that hold words even where they look like numbers."""
_CELL: Final = 8
"""Bytes of a number."""
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
        RecordError: the file is missing, of unknown kind, unreadable, too large as it is or unpacked, or its channels
            have several rasters.
    """
    refuse_unreadable(path, LARGEST_RECORD, RecordError)
    return _lookup(path, _READERS)(path)


def write_channels(channels: Channels, path: Path) -> None:
    """Write channels of one length; CSV implies SI units, the others state them.

    Raises:
        RecordError: the file's ending is unknown, or a package for it is missing.
        UserError: the file cannot be written.
    """
    write = _lookup(path, _WRITERS)
    write_by(lambda part: write(channels, part), path)


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
    rows: list[list[str]] = []
    with path.open(newline="", encoding="utf-8-sig") as file:
        lines = csv.reader(file, strict=True)
        try:
            rows.extend(lines)
        except (ValueError, csv.Error) as error:
            raise RecordError(
                f"{path} is no CSV file, after line {lines.line_num}: {error}.", "Mend it there, or record again."
            ) from error
    if not rows or not any(rows[0]):
        raise RecordError(
            f"{path} has no header line: it is empty or no CSV file.",
            "Its first line names the channels, each further line is a sample.",
        )
    header, *rows = rows
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
        with pq.ParquetFile(path, page_checksum_verification=True) as file:
            _refuse_large_table(file.metadata, path)
            table = pa.Table.from_batches(_bounded(file.iter_batches(), path), file.schema_arrow)
    except (pa.ArrowException, *PARSER_ERRORS) as error:
        raise RecordError(f"{path} is not a readable Parquet file: {error}.", "Record again.") from error
    _refuse_twins(path, table.column_names)
    stated = {entry.name: (entry.metadata or {}).get(b"unit", b"").decode(errors="replace") for entry in table.schema}
    return Channels(
        {name: table.column(name).to_numpy() for name in table.column_names},
        {name: unit for name, unit in stated.items() if unit},
    )


def _refuse_large_table(metadata: Any, path: Path) -> None:
    if metadata.num_rows * max(metadata.num_columns, 1) * _CELL > LARGEST_RECORD:
        raise RecordError(
            f"{path} has {metadata.num_rows} rows of {metadata.num_columns} channels, more than are read.",
            "Split the record.",
        )


def _bounded(batches: Iterator[Any], path: Path) -> Iterator[Any]:
    """Parts of a table until they are too many: a few bytes may stand for a text repeated a million times."""
    size = 0
    for batch in batches:
        size += batch.nbytes
        if size > LARGEST_RECORD:
            raise RecordError(f"{path} unpacks to more than {LARGEST_RECORD} bytes.", "Split the record.")
        yield batch


def _write_parquet(channels: Channels, path: Path) -> None:
    _require_extra("pyarrow", path)
    import pyarrow as pa
    import pyarrow.parquet as pq

    arrays = [pa.array(values) for values in channels.values.values()]
    fields = [
        pa.field(name, array.type, metadata={"unit": channels.units.get(name, "")})
        for name, array in zip(channels.values, arrays, strict=True)
    ]
    pq.write_table(pa.table(arrays, schema=pa.schema(fields)), path, write_page_checksum=True)


def _read_mf4(path: Path) -> Channels:
    _require_extra("asammdf", path)
    check_blocks(path)
    try:
        signals = read_apart(_signals, path)
    except ValueError as error:
        raise RecordError(f"{path} is not a readable MF4 file: {error}.", "Record again.") from error
    if not signals:
        raise RecordError(f"{path} holds no channels.", "Record again.")
    _refuse_twins(path, [name for name, *_ in signals])
    _, _, time, _ = signals[0]
    for name, _, stamps, _ in signals:
        if not np.array_equal(stamps, time):
            raise RecordError(f"{path}: channel {name} is sampled at another rate.", "Resample to one raster.")
    return Channels(
        {"time": time, **{name: samples for name, _, _, samples in signals}},
        {name: unit for name, unit, _, _ in signals if unit},
    )


def _signals(path: Path) -> list[tuple[str, str, NDArray[np.float64], NDArray[Any]]]:
    """Name, unit, stamps [s] and samples of every channel.

    Raises:
        ValueError: asammdf cannot read the file; or an error of `PARSER_ERRORS`, of its own.
    """
    from asammdf import MDF
    from asammdf.blocks.utils import MdfException

    try:
        with quietly(), MDF(path) as mdf:
            return [
                (one.name, one.unit, np.asarray(one.timestamps, dtype=float), _numbers_or_text(np.asarray(one.samples)))
                for one in mdf.iter_channels(skip_master=True)
            ]
    except MdfException as error:
        raise ValueError(str(error)) from error


@contextmanager
def quietly() -> Iterator[None]:
    """Keep a reader from telling its own story: asammdf prints tracebacks, and its destructor fails as well."""
    hook, unheard = sys.unraisablehook, io.StringIO()
    try:
        with redirect_stdout(unheard), redirect_stderr(unheard):
            yield
    except BaseException as error:
        sys.unraisablehook = lambda _: None
        traceback.clear_frames(error.__traceback__)
        gc.collect()
        raise
    finally:
        sys.unraisablehook = hook


def _numbers_or_text(samples: NDArray[Any]) -> NDArray[Any]:
    return np.char.decode(samples, "utf-8", "replace") if samples.dtype.kind == "S" else samples


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
        # Compressed data carry a checksum, plain ones none.
        mdf.save(path, overwrite=True, compression=1)


def _read_mcap(path: Path) -> Channels:
    return Channels(*read_mcap_channels(path))


def _write_mcap(channels: Channels, path: Path) -> None:
    write_mcap_channels(channels.values, channels.units, path)


_READERS: Final[dict[str, Callable[[Path], Channels]]] = {
    ".csv": _read_csv,
    ".parquet": _read_parquet,
    ".mf4": _read_mf4,
    ".mcap": _read_mcap,
}
_WRITERS: Final[dict[str, Callable[[Channels, Path], None]]] = {
    ".csv": _write_csv,
    ".parquet": _write_parquet,
    ".mf4": _write_mf4,
    ".mcap": _write_mcap,
}

"""Reads a recorded log of any supported format into columns."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable
from pathlib import Path

import can
import numpy as np

from hil.frames.blf import read_blf
from hil.frames.table import NOT_DATA, FrameTable
from hil.recorder import PARTIAL, LogFormat
from ident.errors import RecordError

_READ_ERRORS = (ValueError, OSError, EOFError, KeyError, IndexError, struct.error, zlib.error, can.CanError)


def read_log(path: Path, accept_truncated: bool = False) -> FrameTable:
    """Read the frames of a BLF, ASC, candump or MF4 log.

    Args:
        path: the log; its suffix tells the format.
        accept_truncated: return what can be read of a log whose writer was killed.

    Raises:
        RecordError: the file is missing, empty, of no known format, damaged, or truncated.
    """
    try:
        log_format = LogFormat(path.suffix.lower())
    except ValueError as error:
        raise RecordError(f"{path} is no log of a known format.", f"Use one of {', '.join(LogFormat)}.") from error
    if not path.is_file():
        raise RecordError(f"{path} does not exist.", "Name an existing log.")
    try:
        table, whole = _read(path, log_format)
    except _READ_ERRORS as error:
        raise RecordError(f"{path} is damaged: {error}.", "Drive the step again, or use another copy.") from error
    if not len(table):
        raise RecordError(f"{path} holds no frames.", "Drive the step again.")
    # A candump log that was cut between two lines shows it by its name only.
    whole = whole and PARTIAL not in path.suffixes
    if not whole and not accept_truncated:
        raise RecordError(
            f"{path} is truncated after {len(table)} frames, {table.time[-1] - table.time[0]:.3f} s.",
            "Its step was not finished: drive it again (--resume).",
        )
    return table


def _read(path: Path, log_format: LogFormat) -> tuple[FrameTable, bool]:
    if log_format is LogFormat.BLF:
        fast = read_blf(path)
        if fast is not None:
            return fast
        with can.BLFReader(path) as reader:
            return _collect(reader), True
    if log_format is LogFormat.MF4:
        return _read_mf4(path), True
    return _read_text(path, log_format)


def _read_text(path: Path, log_format: LogFormat) -> tuple[FrameTable, bool]:
    reader_class = can.ASCReader if log_format is LogFormat.ASC else can.CanutilsLogReader
    messages: list[can.Message] = []
    whole = _ends_with_newline(path)
    try:
        with reader_class(path) as reader:
            for message in reader:
                messages.append(message)
    except (ValueError, IndexError):
        # A last line that was cut off in the middle; anything worse leaves no messages or an early end.
        if whole:
            raise
    return _collect(messages), whole and (log_format is LogFormat.CANDUMP or _is_closed_asc(path))


def _read_mf4(path: Path) -> FrameTable:
    try:
        import asammdf  # an extra: only who reads MF4 needs it
    except ImportError as error:
        raise RecordError("Reading MF4 needs asammdf.", "Install quasiomni[records].") from error
    try:
        with can.MF4Reader(path) as reader:
            return _collect(reader)
    except asammdf.blocks.utils.MdfException as error:
        raise ValueError(str(error)) from error


def _ends_with_newline(path: Path) -> bool:
    with path.open("rb") as file:
        file.seek(0, 2)
        if file.tell() == 0:
            return False
        file.seek(-1, 2)
        return file.read(1) == b"\n"


def _is_closed_asc(path: Path) -> bool:
    with path.open("rb") as file:
        file.seek(0, 2)
        file.seek(max(file.tell() - 64, 0))
        return b"End TriggerBlock" in file.read()


def _collect(messages: Iterable[can.Message]) -> FrameTable:
    times, ids, lengths, payload = [], [], [], bytearray()
    for message in messages:
        plain = not (message.is_extended_id or message.is_remote_frame or message.is_error_frame or message.is_fd)
        data = message.data if plain else b""
        times.append(message.timestamp)
        ids.append(message.arbitration_id if plain else NOT_DATA)
        lengths.append(len(data))
        payload += bytes(data).ljust(8, b"\x00")
    return FrameTable(
        time=np.array(times, dtype=np.float64),
        can_id=np.array(ids, dtype=np.uint32),
        length=np.array(lengths, dtype=np.uint8),
        data=np.frombuffer(bytes(payload), dtype=np.uint8).reshape(-1, 8),
    )

"""Reads a recorded log of any supported format into columns."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from importlib.util import find_spec
from pathlib import Path
from typing import Final

import can
import numpy as np

from hil.frames.blf import read_blf
from hil.frames.mcap_log import read_mcap_frames
from hil.frames.recorder import PARTIAL, LogFormat
from hil.frames.table import NOT_DATA, FrameTable
from hil.frames.text_logs import read_asc, read_candump
from ident.errors import RecordError
from ident.reading import LARGEST_RECORD, PARSER_ERRORS, refuse_unreadable
from ident.records.apart import read_apart
from ident.records.channels import quietly
from ident.records.mf4_blocks import check_blocks


def read_log(path: Path, accept_truncated: bool = False) -> FrameTable:
    """Read the frames of a BLF, ASC, candump, MF4 or MCAP log.

    Args:
        path: the log; its suffix tells the format.
        accept_truncated: return what can be read of a log whose writer was killed.

    Raises:
        RecordError: the file is missing, too large, empty, of no known format, damaged, or truncated.
    """
    refuse_unreadable(path, LARGEST_RECORD, RecordError)
    try:
        log_format = LogFormat(path.suffix.lower())
    except ValueError as error:
        raise RecordError(f"{path} is no log of a known format.", f"Use one of {', '.join(LogFormat)}.") from error
    try:
        table, cut = _READERS[log_format](path)
    except PARSER_ERRORS as error:
        raise RecordError(
            f"{path} is damaged: {_said(error)}.", "Drive the step again, or use another copy."
        ) from error
    if not len(table):
        raise RecordError(f"{path} holds no frames{': ' if cut else ''}{cut}.", "Drive the step again.")
    if not np.isfinite(table.time).all():
        first = int(np.argmin(np.isfinite(table.time)))
        raise RecordError(f"{path} is damaged: frame {first} has no stamp.", "Drive the step again.")
    # A candump log that was cut between two lines shows it by its name only.
    cut = cut or ("its name says so" if PARTIAL in path.suffixes else "")
    if cut and not accept_truncated:
        raise RecordError(
            f"{path} is truncated after {len(table)} frames, {table.time[-1] - table.time[0]:.3f} s: {cut}.",
            "Its step was not finished: drive it again (--resume).",
        )
    return table


def read_frames(path: Path) -> list[can.Message]:
    """Every frame of a log with all that its format tells of it, remote, extended and error frames among them.

    Raises:
        RecordError: as `read_log`.
    """
    read_log(path)
    if path.suffix.lower() == LogFormat.MCAP:
        return read_mcap_frames(path)[0]
    # By now it is known to be whole and sound, and python-can's readers tell more of each frame.
    with quietly(), can.LogReader(path) as reader:
        return list(reader)


def _said(error: BaseException) -> str:
    """What an error says, its kind where it says nothing."""
    return (str(error) or type(error).__name__).rstrip(".")


def _read_mf4(path: Path) -> tuple[FrameTable, str]:
    if find_spec("asammdf") is None:  # an extra: only who reads MF4 needs it
        raise RecordError("Reading MF4 needs asammdf.", "Install quasiomni[records].")
    check_blocks(path)
    return read_apart(_mf4_frames, path), ""


def _read_mcap(path: Path) -> tuple[FrameTable, str]:
    frames, cut = read_mcap_frames(path)
    return _collect(frames), cut


def _mf4_frames(path: Path) -> FrameTable:
    from asammdf.blocks.utils import MdfException

    try:
        with quietly(), can.MF4Reader(path) as reader:
            return _collect(reader)
    except MdfException as error:
        raise ValueError(str(error)) from error


def _collect(messages: Iterable[can.Message]) -> FrameTable:
    times, ids, lengths, payload = [], [], [], bytearray()
    for message in messages:
        plain = not (message.is_extended_id or message.is_remote_frame or message.is_error_frame or message.is_fd)
        data = message.data if plain else b""
        times.append(message.timestamp)
        ids.append(message.arbitration_id if plain else NOT_DATA)
        lengths.append(len(data))
        payload += bytes(data[:8]).ljust(8, b"\x00")
    return FrameTable(
        time=np.array(times, dtype=np.float64),
        can_id=np.array(ids, dtype=np.uint32),
        length=np.array(lengths, dtype=np.uint8),
        data=np.frombuffer(bytes(payload), dtype=np.uint8).reshape(-1, 8),
    )


_READERS: Final[dict[LogFormat, Callable[[Path], tuple[FrameTable, str]]]] = {
    LogFormat.BLF: read_blf,
    LogFormat.ASC: read_asc,
    LogFormat.CANDUMP: read_candump,
    LogFormat.MF4: _read_mf4,
    LogFormat.MCAP: _read_mcap,
}
"""Reader of each format: frames, and why the log is not whole, empty where it is."""

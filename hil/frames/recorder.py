"""Writes every frame to a log file as it happens, one file for each step of a campaign.

A file gets its final name after its content is on the disk. That may take longer than enabled drives wait for the next
SYNC, so it is done beside the master, in the order in which the steps were driven.
"""

from __future__ import annotations

import errno
import re
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from copy import copy
from enum import StrEnum
from pathlib import Path
from typing import Any, Protocol

import can

from hil.frames.mcap_log import McapFrames
from ident.errors import RecordError
from ident.writing import finish, sync_folder

INTERLUDE = "interlude"
"""Name of the files that hold what was sent between steps: commissioning, enabling, shut-down."""

PARTIAL = ".part"
"""Mark in the name of a file whose step is not finished."""

UNUSABLE = ".unusable"
"""Mark in the name of a file whose step was driven to its end and cannot be used; it is driven again."""

_FINISHED = re.compile(r"(?P<number>\d{3})_(?P<step>\w+)\.(?P<suffix>\w+)")
_RECORDED = re.compile(r"\d{3}_\w+(\.part|\.unusable)?\.\w+")
_FLUSH_PERIOD = 0.5


class LogFormat(StrEnum):
    """Log formats that are written and read; the value is the file suffix."""

    BLF = ".blf"
    """Vector binary log: compressed, fast, the default."""
    ASC = ".asc"
    """Vector text log."""
    CANDUMP = ".log"
    """Text log of can-utils."""
    MF4 = ".mf4"
    """ASAM MDF 4; slow to write, and kept in memory until the step ends."""
    MCAP = ".mcap"
    """JSON messages that Foxglove reads."""


class _Writer(Protocol):
    file: Any

    def on_message_received(self, msg: can.Message) -> None: ...

    def stop(self) -> None: ...


class Recorder:
    """A tap for a `Master`: frames go to `NNN_step.blf`, or to `NNN_interlude.blf` between steps.

    A file is called `NNN_step.part.blf` until its step is finished and the file on the disk, so that a run which is
    killed leaves every finished step whole and shows which one was not. Numbers go on from the files that are in the
    directory, and no file that is there is ever written over.

    Args:
        directory: where the files go; made if missing.
        log_format: format of the files.
        stamp: gives the time of a frame [s]; None for its own stamp.

    Raises:
        RecordError: the directory cannot be written to.
    """

    def __init__(
        self,
        directory: Path,
        log_format: LogFormat = LogFormat.BLF,
        stamp: Callable[[can.Message], float] | None = None,
    ) -> None:
        self._stamp = stamp
        self._directory = directory
        self._format = log_format
        try:
            directory.mkdir(parents=True, exist_ok=True)
            sync_folder(directory.parent)
        except OSError as error:
            raise _unwritable(directory, error) from error
        self._number = _next_number(directory)
        self._writer: _Writer | None = None
        self._path = directory
        self._name = INTERLUDE
        self._next_flush = float("-inf")
        self._disk = ThreadPoolExecutor(max_workers=1, thread_name_prefix="recorder")
        self._finishing: list[tuple[Path, Future[None]]] = []
        self.frames = 0

    def __call__(self, message: can.Message) -> None:
        """Write a frame.

        Raises:
            RecordError: the disk is full or gone.
        """
        writer = self._writer or self._open(INTERLUDE)
        if self._stamp is not None:
            instant = self._stamp(message)
            message = copy(message)
            message.timestamp = instant
        try:
            writer.on_message_received(message)
            if message.timestamp > self._next_flush:
                writer.file.flush()
                self._next_flush = message.timestamp + _FLUSH_PERIOD
        except OSError as error:
            raise _unwritable(self._path, error) from error
        self.frames += 1

    @contextmanager
    def step(self, name: str) -> Iterator[Path]:
        """Record a step into a file of its own; gives the path that the finished file has, once it is on the disk.

        The file keeps its `.part` name when the step ends by an exception.

        Raises:
            RecordError: the disk is full or gone, now or while an earlier step was finished.
        """
        self._finish()
        self._open(name)
        final = self._final_path()
        try:
            yield final
        except BaseException:
            # The error that is on its way out is the one to report.
            with suppress(RecordError):
                self._stop()
            raise
        self._finish()

    def settle(self) -> None:
        """Return when every finished step is on the disk and has its final name.

        Raises:
            RecordError: the disk is full or gone.
        """
        self._settle(tuple(self._finishing))

    def close(self) -> None:
        """Finish the present file, and return when everything is on the disk.

        Raises:
            RecordError: the disk is full or gone.
        """
        self._finish()
        self.settle()

    def _finish(self) -> None:
        """Close the present file; it gets its final name beside the master."""
        if self._writer is None:
            return
        final, partial = self._final_path(), self._path
        self._stop()
        self._settle([entry for entry in self._finishing if entry[1].done()])
        self._finishing.append((final, self._disk.submit(_finish_new, partial, final)))

    def _settle(self, entries: Sequence[tuple[Path, Future[None]]]) -> None:
        for entry in entries:
            self._finishing.remove(entry)
            path, future = entry
            try:
                future.result()
            except OSError as error:
                raise _unwritable(path, error) from error

    def _open(self, name: str) -> _Writer:
        self._name = name
        self._path = self._directory / f"{self._number:03d}_{name}{PARTIAL}{self._format}"
        try:
            # Another recorder in the same folder has taken the number, and its file is not ours to write over.
            self._path.open("xb").close()
            self._writer = writer = make_writer(self._path, self._format)
        except OSError as error:
            raise _unwritable(self._path, error) from error
        self._next_flush = float("-inf")
        return writer

    def _final_path(self) -> Path:
        return self._directory / f"{self._number:03d}_{self._name}{self._format}"

    def _stop(self) -> None:
        writer, self._writer = self._writer, None
        if writer is None:
            return
        self._number += 1
        try:
            writer.stop()
        except OSError as error:
            raise _unwritable(self._path, error) from error


def _finish_new(partial: Path, final: Path) -> None:
    if final.exists():
        raise FileExistsError(errno.EEXIST, "a file of that name is there")
    finish(partial, final)


def set_aside(path: Path) -> Path:
    """Keep a finished log that cannot be used under a name that says so; gives the new path.

    Raises:
        RecordError: the folder cannot be written to.
    """
    kept = path.with_name(f"{path.stem}{UNUSABLE}{path.suffix}")
    try:
        if kept.exists():
            raise FileExistsError(errno.EEXIST, "a file of that name is there")
        path.rename(kept)
        sync_folder(path.parent)
    except OSError as error:
        raise _unwritable(kept, error) from error
    return kept


def finished_steps(directory: Path) -> list[tuple[str, Path]]:
    """Names and files of the finished steps in a directory, in their order, without the interludes."""
    named = [(step_of(path), path) for path in sorted(directory.glob("*"))]
    return [(step, path) for step, path in named if step is not None and step != INTERLUDE]


def recorded_files(directory: Path) -> list[Path]:
    """Whatever in a directory has the name of a log of a `Recorder`, finished or not."""
    suffixes = tuple(LogFormat)
    return [path for path in directory.glob("*") if _RECORDED.fullmatch(path.name) and path.suffix in suffixes]


def step_of(path: Path) -> str | None:
    """The step that a finished log holds by its name, None when the name is not one of a `Recorder`'s."""
    match = _FINISHED.fullmatch(path.name)
    return match["step"] if match and f".{match['suffix']}" in tuple(LogFormat) else None


def _next_number(directory: Path) -> int:
    numbers = [int(path.name[:3]) for path in directory.glob("[0-9][0-9][0-9]_*")]
    return max(numbers, default=-1) + 1


def make_writer(path: Path, log_format: LogFormat) -> _Writer:
    """A writer of frames.

    Raises:
        RecordError: a package for the format is missing.
        OSError: the file cannot be made.
    """
    if log_format is LogFormat.BLF:
        # Level 1 compresses nearly as well as the default and takes a third of its time.
        return can.BLFWriter(path, compression_level=1)
    if log_format is LogFormat.ASC:
        return can.ASCWriter(path)
    if log_format is LogFormat.CANDUMP:
        return can.CanutilsLogWriter(path)
    if log_format is LogFormat.MCAP:
        return McapFrames(path)
    try:
        return can.MF4Writer(path)
    except NotImplementedError as error:
        raise RecordError("Writing MF4 needs asammdf.", "Install quasiomni[records], or record BLF.") from error


def _unwritable(path: Path, error: OSError) -> RecordError:
    return RecordError(
        f"{path} cannot be written: {error.strerror or error}.", "Choose another directory or free some space."
    )

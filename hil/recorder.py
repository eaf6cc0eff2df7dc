"""Writes every frame to a log file as it happens, one file for each step of a campaign."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from enum import StrEnum
from pathlib import Path
from typing import Any, Protocol

import can

from ident.errors import RecordError

INTERLUDE = "interlude"
"""Name of the files that hold what was sent between steps: commissioning, enabling, shut-down."""

PARTIAL = ".part"
"""Mark in the name of a file whose step is not finished."""

_FINISHED = re.compile(r"(?P<number>\d{3})_(?P<step>\w+)\.(?P<suffix>\w+)")
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


class _Writer(Protocol):
    file: Any

    def on_message_received(self, msg: can.Message) -> None: ...

    def stop(self) -> None: ...


class Recorder:
    """A tap for a `Master`: frames go to `NNN_step.blf`, or to `NNN_interlude.blf` between steps.

    A file is called `NNN_step.part.blf` until its step is finished, so that a run which is killed leaves every
    finished step whole and shows which one was not. Numbers go on from the files that are in the directory.

    Args:
        directory: where the files go; made if missing.
        log_format: format of the files.

    Raises:
        RecordError: the directory cannot be written to.
    """

    def __init__(self, directory: Path, log_format: LogFormat = LogFormat.BLF) -> None:
        self._directory = directory
        self._format = log_format
        try:
            directory.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise _unwritable(directory, error) from error
        self._number = _next_number(directory)
        self._writer: _Writer | None = None
        self._path = directory
        self._name = INTERLUDE
        self._next_flush = float("-inf")
        self.frames = 0

    def __call__(self, message: can.Message) -> None:
        """Write a frame.

        Raises:
            RecordError: the disk is full or gone.
        """
        writer = self._writer or self._open(INTERLUDE)
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
        """Record a step into a file of its own; gives the path that the finished file has.

        The file keeps its `.part` name when the step ends by an exception.
        """
        self.close()
        self._open(name)
        final = self._final_path()
        try:
            yield final
        except BaseException:
            # The error that is on its way out is the one to report.
            with suppress(RecordError):
                self._stop()
            raise
        self.close()

    def close(self) -> None:
        """Finish the present file: flush, close, give it its final name."""
        if self._writer is not None:
            final, partial = self._final_path(), self._path
            self._stop()
            partial.rename(final)

    def _open(self, name: str) -> _Writer:
        self._name = name
        self._path = self._directory / f"{self._number:03d}_{name}{PARTIAL}{self._format}"
        try:
            self._writer = writer = _make_writer(self._path, self._format)
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


def finished_steps(directory: Path) -> list[tuple[str, Path]]:
    """Names and files of the finished steps in a directory, in their order, without the interludes."""
    named = [(step_of(path), path) for path in sorted(directory.glob("*"))]
    return [(step, path) for step, path in named if step is not None and step != INTERLUDE]


def step_of(path: Path) -> str | None:
    """The step that a finished log holds by its name, None when the name is not one of a `Recorder`'s."""
    match = _FINISHED.fullmatch(path.name)
    return match["step"] if match and f".{match['suffix']}" in tuple(LogFormat) else None


def _next_number(directory: Path) -> int:
    numbers = [int(path.name[:3]) for path in directory.glob("[0-9][0-9][0-9]_*")]
    return max(numbers, default=-1) + 1


def _make_writer(path: Path, log_format: LogFormat) -> _Writer:
    if log_format is LogFormat.BLF:
        # Level 1 compresses nearly as well as the default and takes a third of its time.
        return can.BLFWriter(path, compression_level=1)
    if log_format is LogFormat.ASC:
        return can.ASCWriter(path)
    if log_format is LogFormat.CANDUMP:
        return can.CanutilsLogWriter(path)
    try:
        return can.MF4Writer(path)
    except NotImplementedError as error:
        raise RecordError("Writing MF4 needs asammdf.", "Install quasiomni[records], or record BLF.") from error


def _unwritable(path: Path, error: OSError) -> RecordError:
    return RecordError(f"{path} cannot be written: {error.strerror}.", "Choose another directory or free some space.")

"""What was recorded: a run folder, or logs in the order in which they were recorded."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hil.frames import FrameTable, read_log
from hil.frames.recorder import PARTIAL, recorded_files
from hil.frames.table import NOT_DATA
from ident.errors import RecordError


@dataclass(frozen=True)
class Part:
    """One log.

    Attributes:
        name: of its file, without suffix.
        table: its frames, in the order of the log.
    """

    name: str
    table: FrameTable

    def in_time(self) -> Part:
        """With its frames in the order of their stamps: what two interfaces recorded may stand a little out of it."""
        if not (np.diff(self.table.time) < 0).any():
            return self
        order = np.argsort(self.table.time, kind="stable")
        table = self.table
        return Part(
            self.name, FrameTable(table.time[order], table.can_id[order], table.length[order], table.data[order])
        )

    @property
    def start(self) -> float:
        """Stamp of its first frame [s]."""
        return float(self.table.time[0])

    def frames(self) -> Iterator[tuple[float, int, bytes]]:
        """Stamp [s], identifier and data of each data frame with an 11-bit identifier."""
        table = self.table
        rows = zip(table.time.tolist(), table.can_id.tolist(), table.length.tolist(), table.data, strict=True)
        return ((time, can_id, bytes(data[:length])) for time, can_id, length, data in rows if can_id != NOT_DATA)


@dataclass(frozen=True)
class Recording:
    """Logs behind each other.

    Attributes:
        source: where they are from, for people.
        parts: non-empty.
    """

    source: str
    parts: tuple[Part, ...]

    def holds(self, can_id: int) -> bool:
        """Whether there is a frame with this identifier."""
        return any(bool((part.table.can_id == can_id).any()) for part in self.parts)


def read_run_folder(frames: Path, source: str) -> Recording:
    """All logs of a run folder, those that could not be used among them: they were driven too.

    Raises:
        RecordError: a log is damaged, or was not finished, so that nobody knows what happened after its end.
    """
    files = sorted(recorded_files(frames))
    unfinished = [path for path in files if PARTIAL in path.suffixes]
    if unfinished:
        raise RecordError(
            f"{unfinished[0]} was not finished: what happened after its end is in no log.",
            "Name the finished logs one by one, each is a replay of its own.",
        )
    if not files:
        raise RecordError(f"{frames} holds no logs.", "Name a folder that a campaign has driven.")
    return Recording(source, tuple(_part(path) for path in files))


def read_logs(paths: Sequence[Path]) -> Recording:
    """Logs that follow each other in time.

    Raises:
        RecordError: one cannot be read, is truncated, or does not begin after the one before it.
    """
    parts = tuple(_part(path) for path in paths)
    for before, after, path in zip(parts, parts[1:], paths[1:], strict=False):
        if after.start < float(before.table.time[-1]):
            raise RecordError(
                f"{path} begins before {before.name} ends.",
                "Name logs in the order in which they were recorded, by one clock; or replay each by itself.",
            )
    return Recording(", ".join(map(str, paths)), parts)


def _part(path: Path) -> Part:
    return Part(path.stem, read_log(path))

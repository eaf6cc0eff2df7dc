"""From a run folder, a log or a record to a file of another format, which gets all that it can hold."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from heapq import merge
from operator import itemgetter
from pathlib import Path
from typing import Final

import can

from hil.campaign.folder import RunFolder, describe, open_run, sources_of
from hil.campaign.reading import read_any, read_as
from hil.frames.logs import read_frames
from hil.frames.mcap_log import CAN, FRAMES, log_time, message_of
from hil.frames.recorder import INTERLUDE, LogFormat, make_writer, recorded_files, step_of
from ident.errors import RecordError
from ident.records.files import read_record, write_record
from ident.records.mcap_channels import RECORD, record_topic, samples
from ident.records.mcap_file import McapWriter, read_topics, require_mcap
from ident.records.record import Record
from ident.records.table import CHANNEL_UNITS, table_from_record
from ident.writing import refuse_inputs, write_by

_LOGS: Final = (LogFormat.BLF, LogFormat.ASC, LogFormat.CANDUMP)
"""Formats that hold frames and nothing else."""
_RECORDS: Final = (".csv", ".parquet")
"""Formats that hold channels and nothing else."""
_BOTH: Final = (LogFormat.MF4, LogFormat.MCAP)
"""Formats that hold frames or channels; MCAP both at once."""
_PAUSE: Final = 1.0
"""Time between two logs of a run whose stamps begin again [s]."""


Log = tuple[Path, list[can.Message]]
"""A log, and its frames."""


@dataclass(frozen=True)
class Converted:
    """What was written: how many frames, how many samples of channels."""

    frames: int = 0
    samples: int = 0


def convert(source: Path, target: Path, vehicle: str | None = None, network: Path | None = None) -> Converted:
    """Write what a run folder, a log or a record holds into a file of another format.

    Frames go into formats of frames, channels into those of channels, whatever of both there is into MCAP. Frames are
    decoded where channels are wanted.

    Args:
        source: run folder, log, or record.
        target: its ending tells the format.
        vehicle, network: by which frames are decoded, in place of those of a run folder.

    Raises:
        RecordError: the source cannot be read, or does not hold what the target is of.
        UserError: the target cannot be written, or is read.
    """
    suffix = target.suffix.lower()
    if suffix not in (*_LOGS, *_RECORDS, *_BOTH):
        raise RecordError(f"{target} ends in {target.suffix!r}.", f"Use {', '.join((*_LOGS, *_RECORDS, *_BOTH))}.")
    refuse_inputs([target], sources_of(source))
    if suffix == LogFormat.MCAP:
        return _to_mcap(source, target, vehicle, network)
    frames = _holds_frames(source)
    # An MF4 file is a log where its name is that of one, here as everywhere else.
    channels = suffix == LogFormat.MF4 and step_of(target) is None and (not frames or _tells_steps(source))
    if suffix in _RECORDS or channels:
        record = _record_of(source, vehicle, network)
        write_record(record, target)
        return Converted(samples=_count(record))
    if not frames:
        raise RecordError(f"{source} holds no frames.", f"Convert it to {', '.join((*_RECORDS, *_BOTH))}.")
    return _to_log([frame for _, log in _logs_of(source) for frame in log], target, LogFormat(suffix))


def _to_mcap(source: Path, target: Path, vehicle: str | None, network: Path | None) -> Converted:
    """Frames as they are, and channels where there are any: those of a record, of a run, and of a log of a step."""
    require_mcap(target)
    logs = list(_logs_of(source)) if _holds_frames(source) else []
    record = _record_of(source, vehicle, network) if not logs or _tells_steps(source) else None
    table = {} if record is None else table_from_record(record)
    topics = [FRAMES] * bool(logs) + ([record_topic(table, CHANNEL_UNITS)] if table else [])
    stamps = _stamps_of(record, logs, _sync_of(source, vehicle, network)) if record is not None else None
    frames = ((log_time(frame.timestamp), CAN, message_of(frame)) for _, log in logs for frame in log)
    channels = ((stamp, RECORD, message) for stamp, message in samples(table, stamps)) if table else iter(())

    def write(path: Path) -> None:
        with path.open("wb") as file:
            writer = McapWriter(file, *topics)
            # Players that read from the beginning to the end want both in the order of time.
            for stamp, topic, message in merge(frames, channels, key=itemgetter(0)):
                writer.write(topic, stamp, message)
            writer.finish()

    write_by(write, target)
    return Converted(sum(len(log) for _, log in logs), 0 if record is None else _count(record))


def _stamps_of(record: Record, logs: Sequence[Log], sync_cob_id: int) -> list[int] | None:
    """Log times [ns] of all samples, so that they lie at the SYNCs they were taken at; None where no frames tell."""
    steps = [log for path, log in logs if step_of(path) not in (None, INTERLUDE)]
    syncs = [
        [frame for frame in log if frame.arbitration_id == sync_cob_id and not frame.is_extended_id] for log in steps
    ]
    starts = [sync[0].timestamp if sync else None for sync in syncs]
    if len(starts) != len(record.segments) or None in starts:
        return None
    return [
        log_time(start + instant)
        for start, segment in zip(starts, record.segments, strict=True)
        if start is not None
        for instant in segment.time.tolist()
    ]


def _sync_of(source: Path, vehicle: str | None, network: Path | None) -> int:
    """Identifier of the SYNC."""
    run = open_run(source) if RunFolder(source).manifest.is_file() else None
    return describe(run, vehicle, network).network.sync_cob_id


def _to_log(frames: Sequence[can.Message], target: Path, log_format: LogFormat) -> Converted:
    def write(path: Path) -> None:
        writer = make_writer(path, log_format)
        for frame in frames:
            writer.on_message_received(frame)
        writer.stop()

    write_by(write, target)
    return Converted(frames=len(frames))


def _count(record: Record) -> int:
    return sum(len(segment) for segment in record.segments)


def _holds_frames(source: Path) -> bool:
    if source.is_dir():
        return True
    suffix = source.suffix.lower()
    if suffix == LogFormat.MCAP and source.is_file():
        return CAN in read_topics(source)[0]
    # Both kinds of MF4 have one ending; a log has the name of its step, as everywhere else.
    return suffix in _LOGS or (suffix == LogFormat.MF4 and step_of(source) is not None)


def _tells_steps(source: Path) -> bool:
    """Whether there are channels beside the frames: whose frames are decoded, or that lie in the same file."""
    if source.suffix.lower() == LogFormat.MCAP:
        return RECORD in read_topics(source)[0]
    return source.is_dir() or step_of(source) is not None


def _record_of(source: Path, vehicle: str | None, network: Path | None) -> Record:
    if source.suffix.lower() == LogFormat.MCAP and RECORD in read_topics(source)[0]:
        return read_record(source)
    record, described = read_as(source, vehicle, network)
    return record if source.is_dir() else read_any(source, described.network)


def _logs_of(source: Path) -> Iterator[Log]:
    """The logs of a source; where the stamps of one begin again before the last, it is put behind that."""
    folder = RunFolder(source).frames if RunFolder(source).frames.is_dir() else source
    paths = sorted(recorded_files(folder)) if source.is_dir() else [source]
    end = None
    for path in paths:
        frames = read_frames(path)
        late = 0.0 if end is None or frames[0].timestamp >= end else end + _PAUSE - frames[0].timestamp
        if late:
            for frame in frames:
                frame.timestamp += late
        end = max(frame.timestamp for frame in frames)
        yield path, frames

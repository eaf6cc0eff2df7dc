"""Records from whatever a run left behind: run folder, folder of logs, single logs, or plain record files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from hil.campaign.folder import Run, RunFolder, describe, open_run
from hil.frames import DecodedLog, decode_log
from hil.frames.recorder import INTERLUDE, LogFormat, finished_steps, step_of
from hil.network import Network
from hil.network.described import Described, differences
from ident.campaign.plan import Plan
from ident.campaign.steps import LOADED
from ident.errors import RecordError
from ident.records.files import read_record
from ident.records.record import PAYLOAD, Record, Segment, Step, make_segment


def read_run(path: Path) -> Record:
    """Record of the finished steps of a run folder, decoded from its frames.

    Raises:
        DataFileError, RecordError: the folder or a log in it cannot be used.
    """
    return read_driven(open_run(path))


def read_driven(run: Run) -> Record:
    """Record of the finished steps of a run, decoded from its frames.

    Raises:
        RecordError: there is no finished step, or a log cannot be used.
    """
    path = run.folder.path
    logs = finished_steps(run.folder.frames)
    if not logs:
        raise RecordError(f"{path} holds no finished step.", "Drive the campaign, or go on with it (--resume).")
    return _with_payload(_record(logs, run.network, run.plan, str(path)), run.payload)


def _with_payload(record: Record, payload: float) -> Record:
    """The load as a channel of the steps that were driven with it [kg]."""
    segments = [
        replace(segment, extra={**segment.extra, PAYLOAD: np.full(len(segment), payload)})
        if segment.step in LOADED
        else segment
        for segment in record.segments
    ]
    return replace(record, segments=segments)


def read_logs(paths: Sequence[Path], network: Network) -> Record:
    """Record from logs named `NNN_step.blf` (or another format); the repeats of the excitation are not known.

    Raises:
        RecordError: a name does not tell the step, or a log cannot be used.
    """
    logs = []
    for path in paths:
        step = step_of(path)
        if step is None:
            raise RecordError(f"{path} does not tell which step it holds.", "Name it like 003_straight.blf.")
        if step == INTERLUDE:
            raise RecordError(f"{path} holds what was sent between steps.", "Name the logs of steps.")
        logs.append((step, path))
    return _record(logs, network, None, ", ".join(str(path) for path in paths))


_OF_BOTH_KINDS: Final = (LogFormat.MF4, LogFormat.MCAP)
"""Formats of logs and of records: there the name tells which it is."""


def read_any(path: Path, network: Network) -> Record:
    """Record from a run folder, a folder of logs, a log, or a CSV, Parquet, MF4 or MCAP record.

    Raises:
        DataFileError, RecordError: there is nothing usable at the path.
    """
    if path.is_dir():
        if RunFolder(path).manifest.is_file():
            return read_run(path)
        folder = RunFolder(path).frames if RunFolder(path).frames.is_dir() else path
        logs = [log for _, log in finished_steps(folder)]
        if not logs:
            raise RecordError(f"{path} holds no logs of finished steps.", "Name a run folder or a record.")
        return read_logs(logs, network)
    if path.suffix in tuple(LogFormat) and (path.suffix not in _OF_BOTH_KINDS or step_of(path) is not None):
        if not path.is_file():
            raise RecordError(f"{path} does not exist.", "Name an existing log.")
        return read_logs([path], network)
    return read_record(path)


def read_as(path: Path, vehicle: str | None, network: Path | None) -> tuple[Record, Described]:
    """Record from anything that `read_any` takes, with the vehicle that it is of.

    Args:
        path: run folder, folder of logs, log, or record.
        vehicle, network: files to take in place of those of a run folder; those of the prototype where there is none.

    Raises:
        DataFileError, RecordError: there is nothing usable at the path, or a file that is given cannot be used.
    """
    run = open_run(path) if RunFolder(path).manifest.is_file() else None
    described = describe(run, vehicle, network)
    if run is not None:
        return read_driven(replace(run, network=described.network)), described
    return read_any(path, described.network), described


def first_run(paths: Sequence[Path]) -> Run | None:
    """The first run folder among several records, whose vehicle is theirs where none is named.

    Raises:
        DataFileError: it cannot be read.
    """
    folders = [path for path in paths if RunFolder(path).manifest.is_file()]
    return open_run(folders[0]) if folders else None


def read_of(path: Path, vehicle: str | None, network: Path | None, described: Described) -> Record:
    """One of several records of one vehicle.

    Args:
        path: anything that `read_any` takes.
        vehicle, network: files that were named in place of those of run folders.
        described: the vehicle that all of them are of.

    Raises:
        DataFileError, RecordError: there is nothing usable at the path, or it is a run of another vehicle.
    """
    if not RunFolder(path).manifest.is_file():
        return read_any(path, described.network)
    record, own = read_as(path, vehicle, network)
    if own.vehicle.geometry != described.vehicle.geometry:
        raise RecordError(
            f"{path} is a run of another vehicle than {described.vehicle.path}: "
            f"{'; '.join(differences(described.vehicle, own.vehicle))}.",
            "Take runs of one vehicle, or say which one it is (--vehicle).",
        )
    return record


def whole_records(records: Sequence[Record]) -> list[Record]:
    """Records put together until a step would come twice: the logs of one campaign are one record.

    A step alone says less of its channels than all of them do.
    """
    groups: list[list[Record]] = []
    for record in records:
        steps = {step for member in groups[-1] for step in member.steps} - {Step.ALIGNMENT} if groups else set()
        if groups and not steps & set(record.steps):
            groups[-1].append(record)
        else:
            groups.append([record])
    return [join(group) for group in groups]


def join(records: Sequence[Record]) -> Record:
    """All segments of several records behind each other.

    Raises:
        RecordError: one is given twice; it would count as two drives, and the intervals come out too narrow.
    """
    sources = [record.source for record in records]
    twins = sorted({source for source in sources if sources.count(source) > 1})
    if twins:
        raise RecordError(f"{', '.join(twins)} is given more than once.", "Name every record once.")
    segments = [segment for record in records for segment in record.segments]
    notes = tuple(note for record in records for note in record.notes)
    return Record(segments, ", ".join(record.source for record in records), notes)


def _record(logs: Sequence[tuple[str, Path]], network: Network, plan: Plan | None, source: str) -> Record:
    decoded = [(step, path, decode_log(path, network)) for step, path in logs]
    notes = tuple(note for _, path, log in decoded if (note := _note(path, log)))
    return Record([segment_of(step, path, log, network, plan) for step, path, log in decoded], source, notes)


def _note(path: Path, log: DecodedLog) -> str:
    if not log.resampled:
        return ""
    return (
        f"{path.name}: the master did not keep its cycle ({log.missing} cycles left out, others up to "
        f"{log.jitter * 1e3:.2f} ms off); its samples are interpolated to the grid."
    )


def segment_of(step: str, path: Path, log: DecodedLog, network: Network, plan: Plan | None) -> Segment:
    """The segment of a decoded step; the repeats of its excitation are those of the plan.

    Raises:
        RecordError: a sample breaks the contract of records, or the log has not the cycles that were planned.
    """
    return make_segment(
        Segment(
            step=step,
            sample_time=network.cycle_period,
            time=log.time,
            motor_torques=log.motor_torques,
            wheel_angles=log.wheel_angles,
            steering_angles=log.steering_angles,
            period=_periods(step, path, log, plan),
            command_torques=log.command_torques,
        ),
        str(path),
    )


def _periods(step: str, path: Path, log: DecodedLog, plan: Plan | None) -> NDArray[np.int64]:
    """Repeat of every row, -1 outside of any. A row belongs to the repeat in which its SYNC was planned.

    A master short of time leaves cycles out and goes on with its plan where it was, so the rows of a log may be more
    than those planned, and the repeats longer. Rows between two SYNCs that are not next to each other belong to none:
    thereby the others of a repeat stay in phase with those of its fellows.
    """
    if plan is None or step not in plan.specs:
        return np.full(len(log.time), -1, dtype=np.int64)
    planned = np.asarray(plan.repeats(step), dtype=np.int64)
    if log.cycles != len(planned):
        raise RecordError(
            f"{path} holds {log.cycles} cycles, and {step} was planned with {len(planned)}.",
            "Drive the step again (--resume), or read the log as it is: identify FOLDER/frames.",
        )
    return np.where(log.cycle < 0, -1, planned[log.cycle])

"""Records from whatever a run left behind: run folder, folder of logs, single logs, or plain record files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hil.campaign.folder import Run, RunFolder, open_run
from hil.frames import DecodedLog, decode_log
from hil.network import Network
from hil.recorder import INTERLUDE, LogFormat, finished_steps, step_of
from ident.campaign.plan import Plan
from ident.campaign.steps import LOADED
from ident.errors import RecordError
from ident.records.files import read_record
from ident.records.record import PAYLOAD, Record, Segment, make_segment


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


def read_any(path: Path, network: Network) -> Record:
    """Record from a run folder, a folder of logs, a log, or a CSV, Parquet or MF4 record.

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
    if path.suffix in tuple(LogFormat) and (path.suffix != LogFormat.MF4 or step_of(path) is not None):
        if not path.is_file():
            raise RecordError(f"{path} does not exist.", "Name an existing log.")
        return read_logs([path], network)
    return read_record(path)


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
        RecordError: a sample breaks the contract of records.
    """
    return make_segment(
        Segment(
            step=step,
            sample_time=network.cycle_period,
            time=log.time,
            motor_torques=log.motor_torques,
            wheel_angles=log.wheel_angles,
            steering_angles=log.steering_angles,
            period=_periods(step, len(log.time), plan),
            command_torques=log.command_torques,
        ),
        str(path),
    )


def _periods(step: str, samples: int, plan: Plan | None) -> NDArray[np.int64]:
    if plan is None or step not in plan.specs:
        return np.full(samples, -1, dtype=np.int64)
    return np.asarray(plan.repeats(step)[:samples], dtype=np.int64)

"""A record as a table of named channels, the form in which files hold it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ident.errors import RecordError
from ident.reading import CONTROL
from ident.records.checks import holds_numbers, numbers, period_numbers
from ident.records.record import PAYLOAD, Record, Segment, make_segment
from ident.vehicle.geometry import WHEELS

TORQUES: Final = tuple(f"torque_{wheel}" for wheel in WHEELS)
COMMANDS: Final = tuple(f"command_torque_{wheel}" for wheel in WHEELS)
WHEEL_ANGLES: Final = tuple(f"beta_{wheel}" for wheel in WHEELS)
STEERING_ANGLES: Final = ("alpha_l", "alpha_r")

REQUIRED: Final = ("time", "step", *TORQUES, *WHEEL_ANGLES, *STEERING_ANGLES)

CHANNEL_UNITS: Final = {
    "time": "s",
    "step": "",
    "period": "",
    **dict.fromkeys((*TORQUES, *COMMANDS), "Nm"),
    **dict.fromkeys((*WHEEL_ANGLES, *STEERING_ANGLES), "rad"),
    PAYLOAD: "kg",
}
"""Unit of each channel of the contract; other channels state their own."""

Table = Mapping[str, NDArray[Any]]


def record_from_table(table: Table, source: str) -> Record:
    """Record from channels by name, all of one length.

    A new segment starts wherever `step` changes, or time falls back to where the segment began: a step may be
    driven twice in a row.

    Raises:
        RecordError: a channel is missing, lengths differ, or a segment breaks the contract.
    """
    _check_channels(table, source)
    table = _in_numbers(table, source)
    period = period_numbers(table.get("period"), len(table["time"]), source)
    steps = np.asarray(table["step"]).astype(str)
    _refuse_control_characters(steps, source)
    starts = _starts(steps, table["time"])
    ends = [*starts[1:], len(steps)]
    segments = [
        make_segment(_slice(table, slice(int(start), int(end)), str(steps[start]), period), source)
        for start, end in zip(starts, ends, strict=True)
    ]
    return Record(segments, source)


def _in_numbers(table: Table, source: str) -> Table:
    """The channels as numbers, but `step`; of others than those of the contract only what numbers are."""
    contract = {*CHANNEL_UNITS} - {"step"}
    kept = {name: channel for name, channel in table.items() if name in contract or holds_numbers(channel)}
    return {name: numbers(name, channel, source) for name, channel in kept.items()} | {"step": table["step"]}


def _refuse_control_characters(steps: NDArray[Any], source: str) -> None:
    odd = next((name for name in np.unique(steps).tolist() if CONTROL.search(name)), None)
    if odd is not None:
        raise RecordError(
            f"{source} has a step named {odd!r}, with control characters.", "Name it in letters, digits and _."
        )


def _starts(steps: NDArray[Any], time: NDArray[np.float64]) -> list[int]:
    candidates = np.flatnonzero((steps[1:] != steps[:-1]) | (np.diff(time) < 0)) + 1
    starts = [0]
    for row in candidates.tolist():
        begun = time[starts[-1]]
        if steps[row] != steps[row - 1] or time[row] <= begun < time[row - 1]:
            starts.append(row)
    return starts


def table_from_record(record: Record) -> dict[str, NDArray[Any]]:
    """Channels by name of all segments behind each other, the inverse of `record_from_table`."""
    parts = [_columns(segment) for segment in record.segments]
    if any(PAYLOAD in part for part in parts):
        parts = [{PAYLOAD: np.zeros(len(part["time"])), **part} for part in parts]
    shared = [name for name in parts[0] if all(name in part for part in parts)]
    return {name: np.concatenate([part[name] for part in parts]) for name in shared}


def _check_channels(table: Table, source: str) -> None:
    missing = [name for name in REQUIRED if name not in table]
    if missing:
        raise RecordError(
            f"{source} lacks the channel{'s' if len(missing) > 1 else ''} {', '.join(missing)}.",
            f"A record needs {', '.join(REQUIRED)}, in SI units.",
        )
    lengths = {name: len(table[name]) for name in table}
    if len(set(lengths.values())) > 1:
        raise RecordError(f"{source} has channels of different lengths: {lengths}.", "Write one row a sample.")
    if not len(table["time"]):
        raise RecordError(f"{source} holds no samples.", "Record again.")


def _stack(table: Table, names: tuple[str, ...], rows: slice) -> NDArray[np.float64]:
    return np.stack([table[name][rows] for name in names], axis=1)


def _slice(table: Table, rows: slice, step: str, period: NDArray[np.int64]) -> Segment:
    known = {*REQUIRED, *COMMANDS, "period"}
    return Segment(
        step=step,
        sample_time=0.0,
        time=table["time"][rows],
        motor_torques=_stack(table, TORQUES, rows),
        wheel_angles=_stack(table, WHEEL_ANGLES, rows),
        steering_angles=_stack(table, STEERING_ANGLES, rows),
        period=period[rows],
        command_torques=_stack(table, COMMANDS, rows) if all(name in table for name in COMMANDS) else None,
        extra={name: table[name][rows] for name in table if name not in known},
    )


def _columns(segment: Segment) -> dict[str, NDArray[Any]]:
    columns: dict[str, NDArray[Any]] = {
        "time": segment.time,
        "step": np.full(len(segment), str(segment.step)),
        "period": segment.period,
        **dict(zip(TORQUES, segment.motor_torques.T, strict=True)),
        **dict(zip(WHEEL_ANGLES, segment.wheel_angles.T, strict=True)),
        **dict(zip(STEERING_ANGLES, segment.steering_angles.T, strict=True)),
        **segment.extra,
    }
    if segment.command_torques is not None:
        columns |= dict(zip(COMMANDS, segment.command_torques.T, strict=True))
    return columns

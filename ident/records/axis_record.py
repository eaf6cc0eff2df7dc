"""Records of servo axes: position and effort of one or several axes over one uniform time, SI.

| channel | shape | unit | meaning |
|---|---|---|---|
| time | (N,) | s | uniform |
| position, or position_1, position_2, ... | (N,) | m or rad | measured position of an axis |
| effort, or effort_1, effort_2, ... | (N,) | N or Nm | drive force or torque on the same side of the gear |
| period | (N,) | - | optional: number of the repeat of the excitation, -1 outside of any |
"""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass
from math import prod
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import io

from ident.errors import RecordError
from ident.reading import LARGEST_RECORD, PARSER_ERRORS, refuse_unreadable
from ident.records.channels import Channels, read_channels, write_channels
from ident.records.checks import numbers, period_numbers, refuse_nonfinite, refuse_short, uniform_sample_time

Array = NDArray[np.float64]

_PARTS: Final = ("position", "effort")
"""Channels of an axis."""


class AxisKind(enum.Enum):
    """How an axis moves, named by the units of its position and effort."""

    LINEAR = ("m", "N")
    ROTARY = ("rad", "Nm")

    @property
    def position_unit(self) -> str:
        """Of the position."""
        return str(self.value[0])

    @property
    def effort_unit(self) -> str:
        """Of the effort."""
        return str(self.value[1])


@dataclass(frozen=True)
class AxisSignals:
    """What is recorded of one axis.

    Attributes:
        name: what follows `position_` in the file, empty for a single axis.
        kind: linear or rotary.
        position, effort: (N,) [m, N or rad, Nm].
        assumed: the file states no unit; the kind is what its reader was given, or linear.
    """

    name: str
    kind: AxisKind
    position: Array
    effort: Array
    assumed: bool = False

    @property
    def label(self) -> str:
        """Name for messages."""
        return f"axis {self.name}" if self.name else "axis"

    def named(self, word: str) -> str:
        """A word with the axis' name behind it, as in channels and results: `position_1`, or `position` alone."""
        return _channel(word, self.name)


@dataclass(frozen=True)
class AxisRecord:
    """One uninterrupted recording of one or several axes.

    Attributes:
        axes: in the order of the file.
        sample_time: [s].
        time: (N,) [s].
        period: (N,) number of the repeat, -1 outside of any.
        source: where the record was read from, for messages.
    """

    axes: tuple[AxisSignals, ...]
    sample_time: float
    time: Array
    period: NDArray[np.int64]
    source: str = "record"

    def __len__(self) -> int:
        return len(self.time)

    def axis(self, name: str | None = None) -> AxisSignals:
        """The axis of that name, which may be left out where there is but one.

        Raises:
            RecordError: there is none of that name, or several and none is named.
        """
        matching = [axis for axis in self.axes if name in (None, axis.name)]
        if len(matching) == 1:
            return matching[0]
        names = ", ".join(repr(axis.name) for axis in self.axes)
        what = f"has several axes ({names})" if name is None else f"has no axis {name!r}"
        raise RecordError(f"{self.source} {what}.", f"Name one of {names}.")


def read_axis_record(path: Path, kind: AxisKind = AxisKind.LINEAR) -> AxisRecord:
    """Read a record of servo axes from CSV, Parquet or MF4, or the MATLAB file of the EMPS benchmark.

    Args:
        path: the file; its ending says which format.
        kind: of axes whose units the file does not state.

    Raises:
        RecordError: the file is missing, unreadable, or breaks the contract.
    """
    channels = _read_emps(path) if path.suffix.lower() == ".mat" else read_channels(path)
    return axis_record_from_channels(channels, str(path), kind)


def write_axis_record(record: AxisRecord, path: Path) -> None:
    """Write a record; CSV implies SI units, Parquet and MF4 state them.

    Raises:
        RecordError: the file's ending is unknown.
    """
    values: dict[str, NDArray[Any]] = {"time": record.time, "period": record.period}
    units = {"time": "s"}
    for axis in record.axes:
        position, effort = axis.named("position"), axis.named("effort")
        values |= {position: axis.position, effort: axis.effort}
        units |= {position: axis.kind.position_unit, effort: axis.kind.effort_unit}
    write_channels(Channels(values, units), path)


def axis_record_from_channels(channels: Channels, source: str, kind: AxisKind = AxisKind.LINEAR) -> AxisRecord:
    """Record from channels by name, checked against the contract.

    Raises:
        RecordError: a channel is missing, lengths differ, a value is not a number, time is not uniform, or a unit
            is no SI unit of an axis.
    """
    _refuse_incomplete(channels.values, source)
    needed = ["time", *(_channel(part, axis) for axis in _axis_names(channels.values) for part in _PARTS)]
    _refuse_unequal({name: channels.values[name] for name in (*needed, "period") if name in channels.values}, source)
    values = {name: numbers(name, channels.values[name], source) for name in needed}
    refuse_short(len(values["time"]), source)
    for name in needed:
        refuse_nonfinite(name, values[name], source)
    time_unit = channels.units.get("time", "s")
    if time_unit != "s":
        raise RecordError(f"{source}: channel time is in {time_unit!r}.", "Convert it to 's': records are in SI units.")
    axes = tuple(
        AxisSignals(
            name=name,
            kind=_kind_of(name, channels.units, source, kind),
            position=values[_channel("position", name)],
            effort=values[_channel("effort", name)],
            assumed=not any(_channel(part, name) in channels.units for part in _PARTS),
        )
        for name in _axis_names(values)
    )
    period = period_numbers(channels.values.get("period"), len(values["time"]), source)
    return AxisRecord(axes, uniform_sample_time(values["time"], source), values["time"], period, source)


def _channel(quantity: str, axis: str) -> str:
    """Name of the channel that holds a quantity of an axis, whose own name may be empty."""
    return f"{quantity}_{axis}" if axis else quantity


def _axis_names(values: Mapping[str, Any]) -> list[str]:
    positions = [name for name in values if name == "position" or name.startswith("position_")]
    return [name.removeprefix("position").removeprefix("_") for name in positions]


def _refuse_incomplete(values: Mapping[str, Any], source: str) -> None:
    names = _axis_names(values)
    wanted = ["time", *(["position"] if not names else []), *(_channel("effort", name) for name in names or [""])]
    missing = [name for name in wanted if name not in values]
    if missing:
        raise RecordError(
            f"{source} lacks the channel{'s' if len(missing) > 1 else ''} {', '.join(missing)}.",
            "A record of axes needs time, position and effort; of several axes time, position_1, effort_1, "
            "position_2, effort_2 and so on; in SI units.",
        )


def _refuse_unequal(values: Mapping[str, NDArray[Any]], source: str) -> None:
    lengths = {name: len(channel) for name, channel in values.items()}
    if len(set(lengths.values())) > 1:
        raise RecordError(f"{source} has channels of different lengths: {lengths}.", "Write one row a sample.")


def _kind_of(name: str, units: Mapping[str, str], source: str, default: AxisKind) -> AxisKind:
    """The kind whose units the file states; units left out may be any."""
    stated = [units.get(_channel(quantity, name)) for quantity in ("position", "effort")]
    if stated == [None, None]:
        return default
    for kind in AxisKind:
        if all(unit in (None, expected) for unit, expected in zip(stated, kind.value, strict=True)):
            return kind
    channels = f"{_channel('position', name)} and {_channel('effort', name)}"
    raise RecordError(
        f"{source}: {channels} are in {stated[0]!r} and {stated[1]!r}.",
        "Give a linear axis in 'm' and 'N', a rotary one in 'rad' and 'Nm'.",
    )


_EMPS: Final = ("t", "qm", "vir", "gtau")
"""Time [s], measured position [m], control voltage [V] and force per volt [N/V] (Janot, Gautier, Brunot 2019)."""


_NUMBER: Final = 8
"""Bytes of one."""


def _read_emps(path: Path) -> Channels:
    refuse_unreadable(path, LARGEST_RECORD, RecordError)
    try:
        if sum(prod(shape) for _, shape, _ in io.whosmat(path)) * _NUMBER > LARGEST_RECORD:
            raise RecordError(f"{path} unpacks to more than {LARGEST_RECORD} bytes.", "Split the record.")
        content = io.loadmat(path)
    except (io.matlab.MatReadError, *PARSER_ERRORS) as error:
        raise RecordError(
            f"{path} is not a readable MATLAB file: {error}.", "Save it with '-v7', or write CSV, Parquet or MF4."
        ) from error
    missing = [name for name in _EMPS if name not in content]
    if missing:
        raise RecordError(
            f"{path} lacks the variable{'s' if len(missing) > 1 else ''} {', '.join(missing)} of the EMPS benchmark.",
            "Write other records as CSV, Parquet or MF4 with the channels time, position and effort.",
        )
    time, position, voltage, gain = (np.asarray(content[name], dtype=float).ravel() for name in _EMPS)
    values = {"time": time, "position": position, "effort": gain * voltage}
    return Channels(values, {"time": "s", "position": "m", "effort": "N"})

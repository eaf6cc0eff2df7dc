"""Channels as messages of an MCAP file, one a sample, so that Foxglove plots them by name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ident.errors import RecordError
from ident.reading import PARSER_ERRORS
from ident.records.mcap_file import NANOSECONDS, McapWriter, Topic, TopicContent, read_topics, require_mcap

RECORD: Final = "/record"
"""Topic of the samples."""
TITLE: Final = "quasiomni.Record"

_KINDS: Final[Mapping[str, str]] = {"f": "number", "i": "integer", "u": "integer", "b": "boolean", "U": "string"}
"""Type in a schema by the kind of an array."""
_DTYPES: Final[Mapping[str, Any]] = {"number": np.float64, "integer": np.int64, "boolean": np.bool_, "string": np.str_}
_UNIT: Final = "unit"

Values = Mapping[str, NDArray[Any]]


def record_topic(values: Values, units: Mapping[str, str]) -> Topic:
    """The topic of some channels, their units in its schema.

    Raises:
        RecordError: a channel holds what JSON has no type for.
    """
    properties = {
        name: {"type": _kind(name, channel), **({_UNIT: units[name]} if units.get(name) else {})}
        for name, channel in values.items()
    }
    return Topic(RECORD, TITLE, {"type": "object", "properties": properties, "required": list(properties)})


def samples(values: Values, stamps: Sequence[int] | None = None) -> Iterator[tuple[int, dict[str, Any]]]:
    """Log time [ns] and message of every sample.

    NaN is null, for JSON has no number for it.

    Args:
        values: (N,) each.
        stamps: (N,) log times [ns]; None: by the channel time, going on where that falls back.

    Raises:
        RecordError: there is no time, or a channel holds infinity.
    """
    if "time" not in values:
        raise RecordError("An MCAP record needs the channel time.", "Add it, or write CSV or Parquet.")
    columns = [_plain(name, channel) for name, channel in values.items()]
    for stamp, row in zip(stamps or log_times(values["time"]), zip(*columns, strict=True), strict=True):
        yield stamp, dict(zip(values, row, strict=True))


def log_times(time: NDArray[Any]) -> list[int]:
    """Stamps [ns] that never fall back, of instants [s] that do where another step begins."""
    instants = np.asarray(time, dtype=np.float64)
    steps = np.diff(instants)
    usual = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    running = max(float(instants[0]), 0.0) + np.concatenate([[0.0], np.cumsum(np.where(steps > 0, steps, usual))])
    return [round(instant * NANOSECONDS) for instant in running.tolist()]


def write_mcap_channels(values: Values, units: Mapping[str, str], path: Path) -> None:
    """Write channels of one length as an MCAP file.

    Raises:
        RecordError: as `samples` and `record_topic`, or the package is missing.
    """
    require_mcap(path)
    topic = record_topic(values, units)
    with path.open("wb") as file:
        writer = McapWriter(file, topic)
        for stamp, message in samples(values):
            writer.write(RECORD, stamp, message)
        writer.finish()


def read_mcap_channels(path: Path) -> tuple[dict[str, NDArray[Any]], dict[str, str]]:
    """Channels of an MCAP file that was written here, and their units.

    Raises:
        RecordError: it is no MCAP file, damaged, truncated, or somebody else's.
    """
    try:
        topics, cut = read_topics(path)
        if cut:
            raise RecordError(f"{path} is truncated: {cut}.", "Export it again.")
        return _channels(own_topic(path, topics, RECORD, TITLE))
    except PARSER_ERRORS as error:
        raise RecordError(f"{path} is not a readable MCAP file: {error}.", "Export it again.") from error


def own_topic(path: Path, topics: Mapping[str, TopicContent], name: str, title: str) -> TopicContent:
    """A topic that was written here.

    Raises:
        RecordError: there is none of that name, or it is of another schema.
    """
    if name not in topics:
        held = ", ".join(topics) or "none with JSON messages"
        raise RecordError(
            f"{path} has no topic {name}; its topics: {held}.",
            "Name a file that `quasiomni convert` or a campaign has written; of another, export CSV or candump.",
        )
    if topics[name].title != title:
        raise RecordError(
            f"{path}: messages of {name} are of the schema {topics[name].title!r}, not {title!r}.",
            "It is another program's topic; name a file that `quasiomni convert` has written.",
        )
    return topics[name]


def _channels(content: TopicContent) -> tuple[dict[str, NDArray[Any]], dict[str, str]]:
    properties = content.schema["properties"]
    values = {
        name: _array(name, entry["type"], [message[name] for message in content.messages])
        for name, entry in properties.items()
    }
    return values, {name: str(entry[_UNIT]) for name, entry in properties.items() if _UNIT in entry}


def _array(name: str, kind: str, cells: list[Any]) -> NDArray[Any]:
    if kind == "number":
        cells = [np.nan if cell is None else float(cell) for cell in cells]
    elif any(type(cell) is not _CELLS[kind] for cell in cells):
        raise ValueError(f"a message in which {name} is no {kind}")
    return np.array(cells, dtype=_DTYPES[kind])


_CELLS: Final[Mapping[str, type]] = {"integer": int, "boolean": bool, "string": str}


def _kind(name: str, channel: NDArray[Any]) -> str:
    kind = _KINDS.get(channel.dtype.kind)
    if kind is None:
        raise RecordError(f"Channel {name} holds neither numbers nor texts.", "Leave it out, or convert it.")
    return kind


def _plain(name: str, channel: NDArray[Any]) -> list[Any]:
    if channel.dtype.kind != "f":
        cells: list[Any] = channel.tolist()
        return cells
    if np.isinf(channel).any():
        first = int(np.argmax(np.isinf(channel)))
        raise RecordError(
            f"Channel {name} holds infinity at sample {first}, which MCAP's JSON has no number for.",
            "Mend the record, or write Parquet.",
        )
    return [None if cell != cell else cell for cell in channel.astype(np.float64).tolist()]

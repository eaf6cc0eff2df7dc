"""MCAP files of JSON messages: one topic written, or read whole or refused.

The format: https://mcap.dev/spec. Foxglove reads messages of the encoding `json` whose schemas are of the encoding
`jsonschema`. Every chunk, the data section and the summary carry a CRC, so a changed bit is seen wherever it is.
"""

from __future__ import annotations

import io
import json
import zlib
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any, Final

from ident.errors import RecordError
from ident.reading import LARGEST_RECORD, PARSER_ERRORS, read_bounded

MAGIC: Final = b"\x89MCAP0\r\n"
_CHUNK: Final = 1 << 16
"""Bytes of messages that are packed together; what is not packed yet is lost where a writer is killed."""
_JSON: Final = "json"
_SCHEMA_ENCODING: Final = "jsonschema"
_CRC: Final = 4
NANOSECONDS: Final = 1e9

Schema = Mapping[str, Any]
"""A JSON schema of an object."""


@dataclass(frozen=True)
class Topic:
    """A topic and what its messages are.

    Attributes:
        name: such as `/can`.
        title: name of the schema.
        schema: of a message.
    """

    name: str
    title: str
    schema: Schema


@dataclass
class TopicContent:
    """What a file holds of a topic.

    Attributes:
        title, schema: of its messages.
        messages: in the order of the file.
    """

    title: str
    schema: Schema
    messages: list[Any] = field(default_factory=list)


class McapWriter:
    """Writes JSON messages.

    Args:
        file: open for writing; the caller closes it.
        topics: that there will be.
    """

    def __init__(self, file: IO[bytes], *topics: Topic) -> None:
        from mcap.writer import Writer

        self._writer = Writer(file, chunk_size=_CHUNK, enable_data_crcs=True)
        self._writer.start(profile="", library="quasiomni")
        self._channels = {topic.name: self._register(topic) for topic in topics}
        self._count = 0

    def write(self, topic: str, log_time: int, message: Mapping[str, Any]) -> None:
        """One message; NaN and infinity are no JSON.

        Args:
            topic: one of those that were given.
            log_time: [ns], not negative.
            message: as its schema says.
        """
        data = json.dumps(message, separators=(",", ":"), allow_nan=False).encode()
        self._writer.add_message(self._channels[topic], log_time, data, log_time, self._count & 0xFFFFFFFF)
        self._count += 1

    def finish(self) -> None:
        """Write the index; without it the file counts as truncated."""
        self._writer.finish()  # type: ignore[no-untyped-call]

    def _register(self, topic: Topic) -> int:
        schema = json.dumps(topic.schema).encode()
        identifier = self._writer.register_schema(topic.title, _SCHEMA_ENCODING, schema)
        return int(self._writer.register_channel(topic.name, _JSON, identifier))


def read_topics(path: Path, *, accept_truncated: bool = False) -> tuple[dict[str, TopicContent], str]:
    """All topics with JSON messages of a file, and why it is not whole; that is empty where it is.

    Args:
        path: the file.
        accept_truncated: give what there is of a file whose writer was killed.

    Raises:
        ValueError: it is no MCAP file, or damaged.
        RecordError: it is larger than what is read, as it is or unpacked, or a package for it is missing.
    """
    require_mcap(path)
    content = read_bounded(path, LARGEST_RECORD, RecordError)
    if not content.startswith(MAGIC):
        raise ValueError("no MCAP header")
    reading = _Reading(path)
    if content.endswith(MAGIC) and len(content) > len(MAGIC):
        reading.whole(content)
        return reading.topics, ""
    cut = "its end is missing"
    if accept_truncated:
        reading.as_far_as_it_goes(content)
    return reading.topics, cut


def require_mcap(path: Path) -> None:
    """See that MCAP can be read and written here.

    Raises:
        RecordError: it cannot.
    """
    try:
        import mcap  # noqa: F401  # an extra: only who reads MCAP needs it
    except ImportError as error:
        raise RecordError(f"{path} needs the package mcap.", "Install it: pip install 'quasiomni[mcap]'.") from error


class _Reading:
    """What has been read of a file."""

    def __init__(self, path: Path) -> None:
        self.topics: dict[str, TopicContent] = {}
        self._path = path
        self._schemas: dict[int, Any] = {}
        self._channels: dict[int, Any] = {}
        self._counts: dict[int, int] = {}
        self._unpacked = 0

    def whole(self, content: bytes) -> None:
        from mcap.exceptions import McapError
        from mcap.records import Footer, Statistics

        stated: dict[int, int] | None = None
        footer: Any = None
        stream = io.BytesIO(content)
        try:
            for record in self._records(stream):
                stated = dict(record.channel_message_counts) if isinstance(record, Statistics) else stated
                footer = record if isinstance(record, Footer) else footer
        except McapError as error:
            raise ValueError(str(error) or type(error).__name__) from error
        if stream.read(1):
            raise ValueError("there is more behind its footer")
        _refuse_changed_summary(content, footer)
        if stated is not None and {k: n for k, n in stated.items() if n} != self._counts:
            raise ValueError("its statistics tell of other messages than there are")

    def as_far_as_it_goes(self, content: bytes) -> None:
        from mcap.exceptions import McapError

        # What is read before it ends is whole: every chunk has its own checksum.
        with suppress(McapError, *PARSER_ERRORS):
            for _ in self._records(io.BytesIO(content)):
                pass

    def _records(self, stream: IO[bytes]) -> Iterator[Any]:
        from mcap.records import Chunk
        from mcap.stream_reader import StreamReader, breakup_chunk

        reader = StreamReader(stream, emit_chunks=True, validate_crcs=True, record_size_limit=LARGEST_RECORD)
        for record in reader.records:
            if isinstance(record, Chunk):
                for inner in breakup_chunk(self._unpack(record), validate_crc=True):
                    self._take(inner)
            else:
                self._take(record)
            yield record

    def _unpack(self, chunk: Any) -> Any:
        """A chunk with its content unpacked to the size that it states, and no further."""
        from mcap.records import Chunk

        self._unpacked += chunk.uncompressed_size
        if self._unpacked > LARGEST_RECORD:
            raise RecordError(f"{self._path} unpacks to more than {LARGEST_RECORD} bytes.", "Split the file.")
        data = _UNPACKED.get(chunk.compression, _unknown)(chunk.data, chunk.uncompressed_size)
        if len(data) != chunk.uncompressed_size:
            raise ValueError(f"a chunk does not unpack to the {chunk.uncompressed_size} bytes that it states")
        return Chunk(
            "", data, chunk.message_end_time, chunk.message_start_time, chunk.uncompressed_crc, chunk.uncompressed_size
        )

    def _take(self, record: Any) -> None:
        from mcap.records import Channel, Message
        from mcap.records import Schema as SchemaRecord

        if isinstance(record, SchemaRecord):
            self._schemas[record.id] = record
        elif isinstance(record, Channel):
            self._channels[record.id] = record
        elif isinstance(record, Message):
            self._counts[record.channel_id] = self._counts.get(record.channel_id, 0) + 1
            self._keep(self._channels[record.channel_id], record.data)

    def _keep(self, channel: Any, data: bytes) -> None:
        schema = self._schemas.get(channel.schema_id)
        if channel.message_encoding != _JSON or schema is None or schema.encoding != _SCHEMA_ENCODING:
            return
        if channel.topic not in self.topics:
            self.topics[channel.topic] = TopicContent(schema.name, json.loads(schema.data))
        self.topics[channel.topic].messages.append(json.loads(data))


def _refuse_changed_summary(content: bytes, footer: Any) -> None:
    if footer is None:
        raise ValueError("it has no footer")
    if footer.summary_crc and footer.summary_start:
        found = zlib.crc32(content[footer.summary_start : len(content) - len(MAGIC) - _CRC])
        if found != footer.summary_crc:
            raise ValueError("the checksum of its summary is another one")


def _unpack_zstd(data: bytes, size: int) -> bytes:
    import zstandard

    try:
        stated = zstandard.get_frame_parameters(data).content_size
        if stated not in (size, zstandard.CONTENTSIZE_UNKNOWN):
            raise ValueError(f"a chunk holds other than the {size} bytes that it states")
        return zstandard.ZstdDecompressor().decompress(data, max_output_size=size)
    except zstandard.ZstdError as error:
        raise ValueError(f"a chunk cannot be unpacked: {error}") from error


def _unpack_lz4(data: bytes, size: int) -> bytes:
    import lz4.frame

    return bytes(lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size + 1))


def _stored(data: bytes, _size: int) -> bytes:
    return data


def _unknown(_data: bytes, _size: int) -> bytes:
    raise ValueError("a chunk is packed by an unknown method")


_UNPACKED: Final = {"": _stored, "zstd": _unpack_zstd, "lz4": _unpack_lz4}
"""How a chunk is unpacked, by the name of its compression."""

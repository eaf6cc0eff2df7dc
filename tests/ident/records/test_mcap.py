"""MCAP files: exact both ways, as others read them, and refused where they are damaged, cut or somebody else's."""

from __future__ import annotations

import io
import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from ident.errors import RecordError
from ident.records.channels import Channels, read_channels, write_channels
from ident.records.mcap_file import read_topics

UNITS = {"time": "s", "torque": "Nm"}
floats = st.floats(allow_infinity=False, width=64)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("mcap")


def sound(path: Path, samples: int = 400) -> Path:
    time = np.arange(samples) * 0.002
    step = np.repeat(["straight", "rotation"], samples // 2)
    write_channels(Channels({"time": time, "torque": np.sin(time), "step": step}, UNITS), path)
    return path


@settings(max_examples=50, deadline=None)
@given(
    torque=st.lists(floats, min_size=1, max_size=30),
    period=st.lists(st.integers(-(2**63), 2**63 - 1), min_size=30, max_size=30),
    step=st.lists(st.text(st.characters(exclude_categories=["Cs", "Cc"])), min_size=30, max_size=30),
)
def test_what_is_written_is_read_again_to_the_bit(
    folder: Path, torque: list[float], period: list[int], step: list[str]
) -> None:
    count = len(torque)
    values = {
        "time": np.arange(count) / 3.0,
        "torque": np.array(torque),
        "period": np.array(period[:count], dtype=np.int64),
        "step": np.array(step[:count], dtype=str),
    }
    path = folder / "drawn.mcap"
    write_channels(Channels(values, UNITS), path)
    found = read_channels(path)
    assert found.units == UNITS
    for name, channel in values.items():
        np.testing.assert_array_equal(found.values[name], channel)
        assert found.values[name].dtype.kind == channel.dtype.kind
    np.testing.assert_array_equal(np.signbit(found.values["torque"]), np.signbit(values["torque"]) & ~np.isnan(torque))


def test_others_read_it_with_schema_unit_and_time(tmp_path: Path) -> None:
    """By the reader of the format's own package, and by a JSON schema validator."""
    path = sound(tmp_path / "record.mcap")
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        messages = list(reader.iter_messages())
    (channel,) = summary.channels.values()
    assert (channel.topic, channel.message_encoding) == ("/record", "json")
    (schema,) = summary.schemas.values()
    assert schema.encoding == "jsonschema"
    described = json.loads(schema.data)
    assert described["properties"]["torque"] == {"type": "number", "unit": "Nm"}
    for number, (_, _, message) in enumerate(messages):
        content = json.loads(message.data)
        jsonschema.validate(content, described)
        assert content["torque"] == math.sin(number * 0.002)
        assert message.log_time == round(number * 0.002 * 1e9)
    assert len(messages) == 400


def test_time_goes_on_in_the_log_where_another_step_begins(tmp_path: Path) -> None:
    path = tmp_path / "steps.mcap"
    time = np.concatenate([np.arange(20) * 0.002, np.arange(20) * 0.002])
    write_channels(Channels({"time": time}), path)
    with path.open("rb") as file:
        stamps = [message.log_time for _, _, message in make_reader(file).iter_messages()]
    assert np.all(np.diff(stamps) == 2_000_000)
    np.testing.assert_array_equal(read_channels(path).values["time"], time)


def test_infinity_has_no_number_in_json(tmp_path: Path) -> None:
    values = {"time": np.arange(3.0), "torque": np.array([0.0, np.inf, 0.0])}
    with pytest.raises(RecordError, match="torque holds infinity at sample 1"):
        write_channels(Channels(values), tmp_path / "x.mcap")
    assert list(tmp_path.iterdir()) == []


def test_a_changed_byte_is_seen_wherever_it_is(tmp_path: Path) -> None:
    """But in a few places that say nothing of the messages; there everything is read as it was."""
    content = bytearray(sound(tmp_path / "sound.mcap").read_bytes())
    before = read_channels(tmp_path / "sound.mcap")
    damaged = tmp_path / "damaged.mcap"
    refusals = []
    places = np.random.default_rng(3).choice(len(content), 300, replace=False)
    for place in places:
        content[place] ^= 0x10
        damaged.write_bytes(content)
        content[place] ^= 0x10
        try:
            found = read_channels(damaged)
        except RecordError as error:
            refusals.append(error.what)
        else:
            for name, channel in before.values.items():
                np.testing.assert_array_equal(found.values[name], channel)
    assert len(refusals) > 280
    assert all("damaged.mcap" in what for what in refusals)


def test_a_file_that_is_cut_is_refused_wherever(tmp_path: Path) -> None:
    content = sound(tmp_path / "sound.mcap").read_bytes()
    cut = tmp_path / "cut.mcap"
    for size in (*range(0, len(content) - 1, max(len(content) // 100, 1)), len(content) - 1):
        cut.write_bytes(content[:size])
        with pytest.raises(RecordError, match=r"cut\.mcap"):
            read_channels(cut)
    cut.write_bytes(content + b"\x00")
    with pytest.raises(RecordError):
        read_channels(cut)


def foreign(path: Path, topic: str, encoding: str, title: str, *, compression: Any = CompressionType.ZSTD) -> Path:
    with path.open("wb") as file:
        writer = Writer(file, compression=compression)
        writer.start()
        schema = writer.register_schema(title, "jsonschema", b'{"type": "object", "properties": {}}')
        channel = writer.register_channel(topic, encoding, schema)
        writer.add_message(channel, 1, b"{}", 1)
        writer.finish()
    return path


FOREIGN = {
    "another topic": ("/odom", "json", "Odometry", "has no topic /record; its topics: /odom"),
    "another schema": ("/record", "json", "Odometry", "of the schema 'Odometry'"),
    "another encoding": ("/record", "cdr", "quasiomni.Record", "none with JSON messages"),
}


@pytest.mark.parametrize(("topic", "encoding", "title", "said"), FOREIGN.values(), ids=FOREIGN)
def test_a_file_of_others_is_refused_with_what_it_holds(
    tmp_path: Path, topic: str, encoding: str, title: str, said: str
) -> None:
    path = foreign(tmp_path / "bag.mcap", topic, encoding, title)
    with pytest.raises(RecordError, match=said) as caught:
        read_channels(path)
    assert caught.value.remedy


@pytest.mark.parametrize("compression", CompressionType)
def test_files_that_were_packed_by_others_are_read(tmp_path: Path, compression: CompressionType) -> None:
    path = foreign(tmp_path / "bag.mcap", "/x", "json", "X", compression=compression)
    assert read_topics(path)[0]["/x"].messages == [{}]


MAGIC_NUMBERS = {CompressionType.ZSTD: b"\x28\xb5\x2f\xfd", CompressionType.LZ4: b"\x04\x22\x4d\x18"}


@pytest.mark.parametrize("compression", MAGIC_NUMBERS)
@pytest.mark.parametrize("place", [0, 4])
def test_a_chunk_that_is_packed_by_no_rule_is_refused(tmp_path: Path, compression: CompressionType, place: int) -> None:
    """The magic number of its packing, or the descriptor behind it, is another one."""
    path = foreign(tmp_path / "bag.mcap", "/x", "json", "X", compression=compression)
    content = bytearray(path.read_bytes())
    content[content.index(MAGIC_NUMBERS[compression]) + place] ^= 0xFF
    path.write_bytes(content)
    with pytest.raises(RecordError, match=r"bag\.mcap"):
        read_channels(path)


def test_a_bomb_is_refused_before_it_is_unpacked(tmp_path: Path) -> None:
    path = tmp_path / "bomb.mcap"
    with path.open("wb") as file:
        for part in _bomb():
            file.write(part)
    assert path.stat().st_size < 1 << 20
    with pytest.raises(RecordError, match="unpacks to more than"):
        read_channels(path)


def _bomb() -> Iterator[bytes]:
    """A gigabyte of one message."""
    output = io.BytesIO()
    writer = Writer(output, chunk_size=1 << 31)
    writer.start()
    schema = writer.register_schema("quasiomni.Record", "jsonschema", b"{}")
    channel = writer.register_channel("/record", "json", schema)
    blanks = b" " * (100 << 20)
    for stamp in range(6):
        writer.add_message(channel, stamp, blanks, stamp)
    writer.finish()
    yield output.getvalue()

"""Logs and records in other formats: nothing is lost that the format can hold."""

from __future__ import annotations

import json
from pathlib import Path

import can
import jsonschema
import numpy as np
import pytest
from mcap.reader import make_reader

from emulator.firmware.flywheels import Flywheels
from hil.bench.lockstep import LockstepBench
from hil.campaign.reading import read_any
from hil.converting.convert import convert
from hil.frames import read_log
from hil.frames.logs import read_frames
from hil.frames.recorder import LogFormat, Recorder
from hil.master import Master
from hil.network import Network
from ident.errors import RecordError, UserError
from ident.records.files import read_record

KINDS = [
    can.Message(1.25, 0x181, is_extended_id=False, data=b"\x01\x02\x03", is_rx=True),
    can.Message(1.2500000001, 0x1ABCDEF, is_extended_id=True, data=b"", is_rx=False),
    can.Message(1.3, 0x702, is_extended_id=False, is_remote_frame=True, dlc=1),
    can.Message(1.4, 0, is_error_frame=True, is_extended_id=False),
    can.Message(1.5 + 1 / 3, 0x7FF, is_extended_id=False, data=bytes(range(8)), is_rx=False),
]


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory, network: Network) -> Path:
    recorder = Recorder(tmp_path_factory.mktemp("log"))
    with (
        LockstepBench(Flywheels()) as bench,
        Master(bench.bus, bench.clock, network, recorder) as master,
    ):
        master.boot()
        master.enable()
        with recorder.step("straight") as path:
            for k in range(200):
                master.exchange((0.1 * np.sin(0.1 * k), 0.2, -0.1, 0.0))
    recorder.close()
    return path


def test_a_log_comes_back_from_mcap_as_it_was(tmp_path: Path, log: Path) -> None:
    convert(log, tmp_path / "000_straight.mcap")
    assert convert(tmp_path / "000_straight.mcap", tmp_path / "back.blf").frames == len(read_log(log))
    one, other = read_frames(log), read_frames(tmp_path / "back.blf")
    for before, after in zip(one, other, strict=True):
        assert before.equals(after, timestamp_delta=1e-9, check_channel=False)
    tables = [read_log(path) for path in (log, tmp_path / "000_straight.mcap")]
    for column in ("can_id", "length", "data"):
        np.testing.assert_array_equal(*(getattr(table, column) for table in tables))
    # Nanoseconds of a BLF log become seconds by one rounding here, and by another in python-can.
    np.testing.assert_allclose(tables[1].time, tables[0].time, rtol=1e-15)


def test_every_kind_of_frame_comes_back_to_the_bit(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path, LogFormat.MCAP)
    with recorder.step("mixed") as path:
        for frame in KINDS:
            recorder(frame)
    recorder.close()
    for before, after in zip(KINDS, read_frames(path), strict=True):
        assert before.equals(after, timestamp_delta=0.0, check_channel=False)


def test_others_find_frames_and_samples_on_one_time(tmp_path: Path, log: Path, network: Network) -> None:
    """A SYNC may wait for one frame, 135 bits at 1 Mbit/s."""
    path = tmp_path / "both.mcap"
    done = convert(log, path)
    with path.open("rb") as file:
        messages = list(make_reader(file, validate_crcs=True).iter_messages())
    for schema, _, message in messages[::50]:
        jsonschema.validate(json.loads(message.data), json.loads(schema.data))
    by_topic = {
        name: [message for _, channel, message in messages if channel.topic == name] for name in ("/can", "/record")
    }
    assert (done.frames, done.samples) == (len(by_topic["/can"]), len(by_topic["/record"])) == (len(read_log(log)), 200)
    syncs = [m.log_time for m in by_topic["/can"] if json.loads(m.data)["id"] == network.sync_cob_id]
    np.testing.assert_allclose([m.log_time for m in by_topic["/record"]], syncs, atol=1.35e5)
    stamps = [message.log_time for _, _, message in messages]
    assert stamps == sorted(stamps)


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".mf4", ".mcap"])
def test_a_record_goes_through_mcap_unchanged(tmp_path: Path, log: Path, network: Network, suffix: str) -> None:
    convert(log, tmp_path / "record.mcap")
    convert(tmp_path / "record.mcap", tmp_path / f"again{suffix}")
    (before,) = read_any(log, network).segments
    (after,) = read_record(tmp_path / f"again{suffix}").segments
    for name in ("time", "motor_torques", "wheel_angles", "steering_angles", "command_torques"):
        np.testing.assert_array_equal(getattr(after, name), getattr(before, name))


MISTAKES = {
    "an ending that is none": ("log", "x.xyz", "ends in '.xyz'"),
    "frames of a record": ("record.csv", "x.blf", "holds no frames"),
    "over itself": ("log", "log", "is read by this very command"),
    "a log of others": ("bag.mcap", "x.blf", "holds no frames"),
}


@pytest.mark.parametrize(("source", "target", "said"), MISTAKES.values(), ids=MISTAKES)
def test_what_cannot_be_converted_is_said_and_nothing_is_left(
    tmp_path: Path, log: Path, source: str, target: str, said: str
) -> None:
    convert(log, tmp_path / "record.csv")
    convert(tmp_path / "record.csv", tmp_path / "bag.mcap")
    before = sorted(tmp_path.iterdir())
    paths = [log if name == "log" else tmp_path / name for name in (source, target)]
    with pytest.raises(UserError, match=said) as caught:
        convert(*paths)
    assert caught.value.remedy
    assert sorted(tmp_path.iterdir()) == before


def test_a_cut_log_is_refused_and_what_there_is_can_be_had(tmp_path: Path, log: Path) -> None:
    convert(log, tmp_path / "000_straight.mcap")
    content = (tmp_path / "000_straight.mcap").read_bytes()
    cut = tmp_path / "001_straight.mcap"
    cut.write_bytes(content[: 2 * len(content) // 3])
    with pytest.raises(RecordError, match="truncated after"):
        read_log(cut)
    assert 0 < len(read_log(cut, accept_truncated=True)) < len(read_log(log))

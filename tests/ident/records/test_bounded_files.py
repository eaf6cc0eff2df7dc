"""Records take no more memory than they may, whatever their files say of themselves, and damaged ones say where."""

from __future__ import annotations

import csv
import struct
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from scipy import io

from ident import reading
from ident.errors import RecordError
from ident.records import apart, channels, mf4_blocks
from ident.records.axis_record import read_axis_record
from ident.records.channels import Channels, read_channels, write_channels
from ident.records.files import read_record

SAMPLES = 2000
LIMIT = 100_000


@pytest.fixture
def small_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Bounds that a small file can reach."""
    for module in (channels, mf4_blocks, reading):
        monkeypatch.setattr(module, "LARGEST_RECORD", LIMIT)


def constant(path: Path) -> Path:
    """A file that unpacks to many times its size."""
    time = 0.002 * np.arange(SAMPLES)
    write_channels(Channels({"time": time, **{f"c{k}": np.zeros(SAMPLES) for k in range(30)}}), path)
    return path


@pytest.mark.parametrize("suffix", [".parquet", ".mf4"])
@pytest.mark.usefixtures("small_limit")
def test_a_small_file_that_unpacks_to_a_large_record_is_refused(tmp_path: Path, suffix: str) -> None:
    path = constant(tmp_path / f"bomb{suffix}")
    assert path.stat().st_size < LIMIT
    with pytest.raises(RecordError, match=r"bomb.* (unpacks to|rows of)"):
        read_channels(path)


@pytest.mark.usefixtures("small_limit")
def test_a_text_repeated_in_every_row_counts_as_often_as_it_stands_there(tmp_path: Path) -> None:
    path = tmp_path / "bomb.parquet"
    pq.write_table(pa.table({"step": pa.array(["x" * 1000] * SAMPLES)}), path)
    assert path.stat().st_size < LIMIT / 10
    with pytest.raises(RecordError, match="unpacks to more than"):
        read_channels(path)


def test_a_file_beyond_the_bound_is_not_opened(tmp_path: Path) -> None:
    path = tmp_path / "large.csv"
    with path.open("wb") as file:
        file.truncate(reading.LARGEST_RECORD + 1)
    with pytest.raises(RecordError, match="at most"):
        read_channels(path)


def test_a_matlab_file_of_zeros_is_bounded_by_what_it_says_of_itself(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from ident.records import axis_record

    path = tmp_path / "bomb.mat"
    io.savemat(path, {"t": np.zeros(SAMPLES * 10)}, do_compression=True)
    assert path.stat().st_size < LIMIT
    monkeypatch.setattr(axis_record, "LARGEST_RECORD", LIMIT)
    with pytest.raises(RecordError, match="unpacks to more than"):
        read_axis_record(path)


def blocks(content: bytes) -> dict[bytes, list[int]]:
    """Addresses of the blocks of an MF4 file by their kind."""
    found: dict[bytes, list[int]] = {}
    place = content.find(b"##")
    while place >= 0:
        found.setdefault(content[place : place + 4], []).append(place)
        place = content.find(b"##", place + 1)
    return found


def patched(content: bytes, place: int, code: str, *values: int) -> bytes:
    packed = struct.pack(code, *values)
    return content[:place] + packed + content[place + len(packed) :]


LIES: dict[str, tuple[Callable[[bytes, dict[bytes, list[int]]], bytes], str]] = {
    "a circle of channels": (
        lambda content, at: patched(content, at[b"##CN"][1] + 24, "<Q", at[b"##CN"][0]),
        r"CN block at byte \d+ leads back to byte",
    ),
    "a data group that follows itself": (
        lambda content, at: patched(content, at[b"##DG"][0] + 24, "<Q", at[b"##DG"][0]),
        r"DG block at byte \d+ leads back to byte",
    ),
    "more samples than there are": (
        lambda content, at: patched(content, at[b"##CG"][0] + 24 + 48 + 8, "<Q", 1 << 60),
        r"bytes of samples, and \d+ are there",
    ),
    "a block of 2^60 bytes": (
        lambda content, at: patched(content, at[b"##DZ"][0] + 8, "<Q", 1 << 60),
        r"DZ block at byte \d+ ends at byte",
    ),
    "packed data that unpack to more": (
        lambda content, at: patched(content, at[b"##DZ"][0] + 24 + 8, "<Q", 8),
        r"bytes of samples, and \d+ are there|does not unpack to",
    ),
    "a million links": (
        lambda content, at: patched(content, at[b"##DG"][0] + 16, "<Q", 1 << 20),
        r"DG block at byte \d+ has 64 bytes and 1048576 links",
    ),
    "a link beyond the end": (
        lambda content, at: patched(content, at[b"##DG"][0] + 32, "<Q", len(content) + 800),
        r"a block should be at byte \d+",
    ),
    "no end": (lambda content, _: content[:-100], "damaged or cut off"),
    "not finished": (lambda content, _: b"UnFinMF " + content[8:], "not finished"),
    "MDF 3": (lambda content, _: patched(content, 28, "<H", 330), "version 3.30"),
}


@pytest.mark.parametrize(("lie", "words"), LIES.values(), ids=LIES)
def test_an_mf4_file_that_lies_about_itself_is_refused_at_its_block(
    tmp_path: Path, lie: Callable[[bytes, dict[bytes, list[int]]], bytes], words: str
) -> None:
    path = constant(tmp_path / "lie.mf4")
    content = path.read_bytes()
    path.write_bytes(lie(content, blocks(content)))
    with pytest.raises(RecordError, match=words):
        read_channels(path)


def die(_path: Path) -> None:
    import ctypes

    ctypes.string_at(0)


def fill_the_memory(_path: Path) -> None:
    bytearray(apart.MEMORY)


def sleep_on(_path: Path) -> None:
    time.sleep(60.0)


def test_a_reader_that_dies_fills_the_memory_or_hangs_is_an_error_and_the_next_one_reads(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    monkeypatch.syspath_prepend(request.config.rootpath)
    path = constant(tmp_path / "sound.mf4")
    for reader, words in ((die, r"died of it \(exit -\d+\)"), (fill_the_memory, "MemoryError")):
        with pytest.raises(ValueError, match=words):
            apart.read_apart(reader, path)
    with monkeypatch.context() as short:
        short.setattr(apart, "SECONDS", 2.0)
        with pytest.raises(ValueError, match="more than 2 s"):
            apart.read_apart(sleep_on, path)
    assert len(read_channels(path).values["time"]) == SAMPLES


@pytest.mark.parametrize("suffix", [".parquet", ".mf4"])
def test_a_bit_that_flipped_in_a_record_written_here_is_seen_wherever_it_is(tmp_path: Path, suffix: str) -> None:
    rng = np.random.default_rng(3)
    path = tmp_path / f"flipped{suffix}"
    values = {"time": 0.002 * np.arange(SAMPLES), "position": rng.normal(size=SAMPLES)}
    write_channels(Channels(values), path)
    content = path.read_bytes()
    for place in rng.integers(len(content) // 10, len(content) // 2, size=20).tolist():
        damaged = bytearray(content)
        damaged[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(damaged)
        with pytest.raises(RecordError, match="flipped"):
            read_channels(path)


def test_a_clock_that_was_set_is_refused_in_a_record_or_cut_at_the_jump(tmp_path: Path) -> None:
    names = [
        "time", "step", "torque_fl", "torque_rl", "torque_fr", "torque_rr", "beta_fl", "beta_rl", "beta_fr", "beta_rr",
        "alpha_l", "alpha_r",
    ]  # fmt: skip
    for jump, pieces in ((1e9, 0), (3600.0, 0), (0.1, 0), (-0.01, 0), (-3600.0, 2)):
        path = tmp_path / "set.csv"
        with path.open("w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(names)
            writer.writerows([0.002 * k + (jump if k >= 100 else 0.0), "straight", *[0.0] * 10] for k in range(200))
        if pieces:
            assert [len(segment) for segment in read_record(path).segments] == [100, 100]
        else:
            with pytest.raises(RecordError, match=r"not uniform: .* after t = 0\.198"):
                read_record(path)


def test_a_step_named_by_control_characters_is_refused(tmp_path: Path) -> None:
    names = "time,step,torque_fl,torque_rl,torque_fr,torque_rr,beta_fl,beta_rl,beta_fr,beta_rr,alpha_l,alpha_r"
    path = tmp_path / "odd.csv"
    path.write_text("\n".join([names, *(f"{0.002 * k},straight_\x1b[2J{',0' * 10}" for k in range(20))]) + "\n")
    with pytest.raises(RecordError, match=r"straight_\\x1b\[2J.* control characters"):
        read_record(path)

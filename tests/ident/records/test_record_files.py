from __future__ import annotations

import gc
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from asammdf import MDF, Signal
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from ident.errors import RecordError
from ident.records.files import read_record, write_record
from ident.records.record import Record
from ident.records.table import CHANNEL_UNITS, REQUIRED, TORQUES, record_from_table, table_from_record

Table = dict[str, NDArray]
SUFFIXES = [".csv", ".parquet", ".mf4"]
printable = st.characters(codec="utf-8", exclude_categories=["Cc"])
finite = st.floats(-1e12, 1e12, allow_subnormal=False)


def assert_same(first: Record, second: Record) -> None:
    assert first.steps == second.steps
    one, other = table_from_record(first), table_from_record(second)
    assert one.keys() == other.keys()
    for name, values in one.items():
        np.testing.assert_array_equal(values, other[name], err_msg=name)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_record_comes_back_from_a_file_to_the_last_bit(
    tmp_path: Path, table_of: Callable[..., Table], suffix: str
) -> None:
    record = record_from_table(table_of(("steering_left", "straight", "a step of my own")), "memory")
    write_record(record, tmp_path / f"record{suffix}")
    assert_same(record, read_record(tmp_path / f"record{suffix}"))


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
@settings(max_examples=20, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(values=st.lists(finite, min_size=20, max_size=20), step=st.text(printable, min_size=1))
def test_any_numbers_and_any_printable_step_name_survive_a_file(
    tmp_path: Path, table_of: Callable[..., Table], suffix: str, values: list[float], step: str
) -> None:
    table = {**table_of(), "torque_fl": np.array(values), "step": np.array([step.rstrip("\0") or "x"] * 20)}
    record = record_from_table(table, "memory")
    write_record(record, tmp_path / f"record{suffix}")
    assert_same(record, read_record(tmp_path / f"record{suffix}"))


@pytest.mark.parametrize("suffix", [".parquet", ".mf4"])
def test_files_that_can_state_units_do(tmp_path: Path, table_of: Callable[..., Table], suffix: str) -> None:
    path = tmp_path / f"record{suffix}"
    write_record(record_from_table(table_of(), "memory"), path)
    if suffix == ".parquet":
        stated = {entry.name: entry.metadata[b"unit"].decode() for entry in pq.read_schema(path)}
    else:
        with MDF(path) as mdf:
            stated = {signal.name: signal.unit for signal in mdf.iter_channels()}
    for name in (*REQUIRED, "command_torque_rr"):
        if name != "time" or suffix == ".parquet":
            assert stated[name] == CHANNEL_UNITS[name], name


def test_a_csv_file_is_a_header_and_plain_numbers(tmp_path: Path, table_of: Callable[..., Table]) -> None:
    write_record(record_from_table(table_of(), "memory"), tmp_path / "record.csv")
    header, first, *_ = (tmp_path / "record.csv").read_text().splitlines()
    row = dict(zip(header.split(","), first.split(","), strict=True))
    assert set(REQUIRED) <= row.keys()
    assert row["step"] == "straight"
    assert float(row["time"]) == 3.0


def test_channels_that_a_contract_does_not_know_are_carried_along(table_of: Callable[..., Table]) -> None:
    table = table_of()
    segment = record_from_table(table, "memory").segments[0]
    np.testing.assert_array_equal(segment.extra["temperature"], table["temperature"])


def test_optional_channels_may_be_absent(table_of: Callable[..., Table]) -> None:
    table = {name: values for name, values in table_of().items() if name in REQUIRED}
    segment = record_from_table(table, "memory").segments[0]
    assert segment.command_torques is None
    assert segment.periods == []
    assert set(segment.period.tolist()) == {-1}


def test_a_segment_ends_where_the_step_changes(table_of: Callable[..., Table]) -> None:
    record = record_from_table(table_of(("straight", "rotation", "straight")), "memory")
    assert [segment.step for segment in record.segments] == ["straight", "rotation", "straight"]
    assert [len(segment) for segment in record.segments] == [20, 20, 20]
    assert record.steps == ["straight", "rotation"]
    assert len(list(record.of("straight"))) == 2
    assert record.sample_time == pytest.approx(0.002)
    assert record.duration == pytest.approx(60 * 0.002)
    assert record.segments[0].periods == [0, 1]


def test_time_may_jump_between_steps(table_of: Callable[..., Table]) -> None:
    table = table_of(("straight", "rotation"))
    table["time"][20:] += 100.0
    assert len(record_from_table(table, "memory").segments) == 2


def test_jitter_below_two_percent_is_uniform_and_above_is_not(table_of: Callable[..., Table]) -> None:
    table = table_of()
    table["time"][7] += 0.9 * 0.02 * 0.002
    assert record_from_table(table, "memory").sample_time == pytest.approx(0.002)
    table["time"][7] += 0.3 * 0.02 * 0.002
    with pytest.raises(RecordError, match="not uniform"):
        record_from_table(table, "memory")


def broken(table: Table, **channels: NDArray) -> Table:
    return {**table, **channels}


def with_value(values: NDArray, index: int, value: float) -> NDArray:
    changed = values.astype(float)
    changed[index] = value
    return changed


BREAKS: dict[str, tuple[Callable[[Table], Table], tuple[str, ...], str]] = {
    "a channel is missing": (
        lambda t: {name: values for name, values in t.items() if name != "beta_rl"},
        ("lacks the channel beta_rl",),
        "torque_fl",
    ),
    "several channels are missing": (
        lambda t: {name: values for name, values in t.items() if name not in TORQUES},
        ("lacks the channels torque_fl, torque_rl",),
        "needs",
    ),
    "a torque is not a number": (
        lambda t: broken(t, torque_rr=with_value(t["torque_rr"], 13, np.nan)),
        ("torque_rr", "1 samples", "sample 13", "'straight'"),
        "Cut that part out",
    ),
    "an angle is infinite": (
        lambda t: broken(t, alpha_r=with_value(t["alpha_r"], 4, np.inf)),
        ("alpha_r", "sample 4"),
        "Cut that part out",
    ),
    "time is not a number": (
        lambda t: broken(t, time=with_value(t["time"], 2, np.nan)),
        ("channel time", "sample 2"),
        "Cut that part out",
    ),
    "a sample was lost": (
        lambda t: broken(t, time=np.where(np.arange(20) < 12, t["time"], t["time"] + 0.002)),
        ("not uniform", "4.000 ms", "t = 3.0220 s", "2.000 ms"),
        "Resample",
    ),
    "time stands still": (lambda t: broken(t, time=np.zeros(20)), ("does not increase",), "increasing"),
    "time runs backwards": (lambda t: broken(t, time=-t["time"]), ("does not increase",), "increasing"),
    "channels differ in length": (lambda t: broken(t, beta_fl=np.zeros(19)), ("different lengths", "19"), "one row"),
    "a step is too short": (
        lambda t: broken(t, step=np.array(["straight"] * 15 + ["rotation"] * 5)),
        ("'rotation'", "5 samples"),
        "at least 10",
    ),
    "a record is empty": (lambda t: {name: values[:0] for name, values in t.items()}, ("no samples",), "Record again"),
    "periods are no numbers": (
        lambda t: broken(t, period=with_value(t["period"], 3, np.nan)),
        ("period",),
        "-1 outside",
    ),
    "periods are infinite": (lambda t: broken(t, period=with_value(t["period"], 3, np.inf)), ("period",), "0, 1, 2"),
    "periods are halves": (lambda t: broken(t, period=with_value(t["period"], 3, 0.5)), ("period",), "0, 1, 2"),
}


@pytest.mark.parametrize("how", BREAKS)
def test_a_broken_contract_is_named_with_place_and_remedy(table_of: Callable[..., Table], how: str) -> None:
    breaks, named, remedy = BREAKS[how]
    with pytest.raises(RecordError) as caught:
        record_from_table(breaks(table_of()), "run.csv")
    assert caught.value.what.startswith("run.csv")
    for text in named:
        assert text in caught.value.what
    assert remedy in caught.value.remedy


@pytest.fixture
def csv_lines(tmp_path: Path, table_of: Callable[..., Table]) -> list[str]:
    write_record(record_from_table(table_of(), "memory"), tmp_path / "whole.csv")
    return (tmp_path / "whole.csv").read_text().splitlines()


def csv_error(tmp_path: Path, text: str | bytes) -> RecordError:
    path = tmp_path / "broken.csv"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    with pytest.raises(RecordError) as caught:
        read_record(path)
    assert str(path) in caught.value.what
    assert caught.value.remedy
    return caught.value


def test_a_csv_file_cut_off_in_a_line_is_refused_with_the_line(tmp_path: Path, csv_lines: list[str]) -> None:
    cut = [*csv_lines[:15], csv_lines[15][: len(csv_lines[15]) // 2]]
    assert "line 16" in csv_error(tmp_path, "\n".join(cut)).what


def test_a_word_among_the_numbers_of_a_csv_file_is_refused_with_its_channel(
    tmp_path: Path, csv_lines: list[str]
) -> None:
    header = csv_lines[0].split(",")
    cells = csv_lines[5].split(",")
    cells[header.index("beta_fr")] = '"1,5"'
    error = csv_error(tmp_path, "\n".join([*csv_lines[:5], ",".join(cells), *csv_lines[6:]]))
    assert "beta_fr" in error.what
    assert "decimal point" in error.remedy


def test_a_channel_of_words_that_the_contract_does_not_know_is_passed_over(
    tmp_path: Path, csv_lines: list[str]
) -> None:
    path = tmp_path / "record.csv"
    path.write_text("\n".join([f"{csv_lines[0]},remark", *(f"{line},wet" for line in csv_lines[1:]), ""]))
    assert "remark" not in read_record(path).segments[0].extra


def test_an_empty_csv_file_is_refused(tmp_path: Path) -> None:
    assert "header" in csv_error(tmp_path, "").what


def test_a_csv_file_of_a_header_alone_is_refused(tmp_path: Path, csv_lines: list[str]) -> None:
    assert "no samples" in csv_error(tmp_path, csv_lines[0]).what


def test_a_csv_file_that_is_none_is_refused(tmp_path: Path) -> None:
    csv_error(tmp_path, bytes(range(256)) * 20)


def test_two_channels_of_one_name_are_refused(tmp_path: Path, csv_lines: list[str]) -> None:
    twins = csv_lines[0].replace("alpha_r", "alpha_l")
    assert "alpha_l" in csv_error(tmp_path, "\n".join([twins, *csv_lines[1:]])).what


def test_an_unknown_ending_lists_the_known_ones(tmp_path: Path, table_of: Callable[..., Table]) -> None:
    record = record_from_table(table_of(), "memory")
    with pytest.raises(RecordError, match=r"\.csv, \.parquet, \.mf4"):
        write_record(record, tmp_path / "record.xlsx")
    with pytest.raises(RecordError, match=r"\.xlsx"):
        read_record(tmp_path / "record.xlsx")


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_missing_file_is_named(tmp_path: Path, suffix: str) -> None:
    with pytest.raises(RecordError, match="does not exist"):
        read_record(tmp_path / f"none{suffix}")


@pytest.mark.parametrize("suffix", [".parquet", ".mf4"])
@pytest.mark.parametrize("share", [0.0, 0.5, 0.95])
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # asammdf closes what it never opened
def test_a_cut_off_binary_file_is_refused(
    tmp_path: Path, table_of: Callable[..., Table], suffix: str, share: float
) -> None:
    path = tmp_path / f"record{suffix}"
    write_record(record_from_table(table_of(samples=400), "memory"), path)
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(RecordError) as caught:
        read_record(path)
    assert str(path) in caught.value.what
    del caught
    gc.collect()


def test_degrees_in_a_parquet_file_are_refused(tmp_path: Path, table_of: Callable[..., Table]) -> None:
    table = table_of()
    fields = [
        pa.field(name, pa.array(values).type, metadata={"unit": "deg" if name == "alpha_l" else ""})
        for name, values in table.items()
    ]
    arrays = [pa.array(values) for values in table.values()]
    pq.write_table(pa.table(arrays, schema=pa.schema(fields)), tmp_path / "record.parquet")
    with pytest.raises(RecordError) as caught:
        read_record(tmp_path / "record.parquet")
    assert "alpha_l is in 'deg'" in caught.value.what
    assert "'rad'" in caught.value.remedy


def mf4_with(path: Path, table: Table, **changes: Signal) -> None:
    with MDF(version="4.10") as mdf:
        for name, values in table.items():
            if name in ("time", "step"):
                continue
            signal = Signal(values, table["time"], name=name, unit=CHANNEL_UNITS.get(name, ""))
            mdf.append([changes.get(name, signal)])
        steps = np.char.encode(table["step"], "utf-8")
        mdf.append([Signal(steps, table["time"], name="step", encoding="utf-8")])
        mdf.save(path, overwrite=True)


def test_an_mf4_file_of_many_groups_on_one_raster_is_read(tmp_path: Path, table_of: Callable[..., Table]) -> None:
    """Measurement tools write a group for each device."""
    table = table_of()
    mf4_with(tmp_path / "record.mf4", table)
    assert_same(record_from_table(table, "memory"), read_record(tmp_path / "record.mf4"))


def test_an_mf4_file_in_milli_newton_metres_is_refused(tmp_path: Path, table_of: Callable[..., Table]) -> None:
    table = table_of()
    mf4_with(
        tmp_path / "r.mf4", table, torque_rl=Signal(table["torque_rl"], table["time"], name="torque_rl", unit="mNm")
    )
    with pytest.raises(RecordError, match="torque_rl is in 'mNm'"):
        read_record(tmp_path / "r.mf4")


@pytest.mark.parametrize("raster", ["fewer samples", "shifted samples"])
def test_an_mf4_file_of_several_rasters_is_refused(tmp_path: Path, table_of: Callable[..., Table], raster: str) -> None:
    table = table_of()
    rows = slice(None, None, 2) if raster == "fewer samples" else slice(None)
    other = Signal(table["beta_rr"][rows], table["time"][rows] + 0.0005, name="beta_rr", unit="rad")
    mf4_with(tmp_path / "record.mf4", table, beta_rr=other)
    with pytest.raises(RecordError, match="another rate") as caught:
        read_record(tmp_path / "record.mf4")
    assert "one raster" in caught.value.remedy


def test_an_mf4_file_without_channels_is_refused(tmp_path: Path) -> None:
    with MDF(version="4.10") as mdf:
        mdf.save(tmp_path / "record.mf4", overwrite=True)
    with pytest.raises(RecordError, match="no channels"):
        read_record(tmp_path / "record.mf4")


def test_a_known_load_is_of_its_step_and_comes_back_from_a_file(tmp_path: Path, table_of: Callable[..., Table]) -> None:
    table = table_of(("straight", "straight_loaded"))
    record = record_from_table({**table, "payload": np.where(table["step"] == "straight", 0.0, 40.0)}, "memory")
    assert [segment.payload for segment in record.segments] == [0.0, 40.0]
    bare = replace(record, segments=[replace(record.segments[0], extra={}), record.segments[1]])
    write_record(bare, tmp_path / "record.csv")
    assert [segment.payload for segment in read_record(tmp_path / "record.csv").segments] == [0.0, 40.0]


@pytest.mark.parametrize("load", [np.linspace(0, 40, 20), np.full(20, -3.0)])
def test_a_load_that_changes_or_pulls_up_is_refused(table_of: Callable[..., Table], load: NDArray) -> None:
    with pytest.raises(RecordError, match="payload is negative or changes"):
        record_from_table({**table_of(), "payload": load}, "memory")

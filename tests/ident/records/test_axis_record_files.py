from __future__ import annotations

import gc
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import io

from ident.errors import RecordError
from ident.records.axis_record import (
    AxisKind,
    AxisRecord,
    AxisSignals,
    axis_record_from_channels,
    read_axis_record,
    write_axis_record,
)
from ident.records.channels import Channels

SAMPLES = 40


def two_axes() -> AxisRecord:
    generator = np.random.default_rng(0)
    axes = tuple(
        AxisSignals(name, kind, *generator.normal(size=(2, SAMPLES)))
        for name, kind in (("1", AxisKind.LINEAR), ("2", AxisKind.ROTARY))
    )
    time = 1.0 + 0.001 * np.arange(SAMPLES)
    return AxisRecord(axes, 0.001, time, np.repeat([-1, 0, 1, -1], SAMPLES // 4))


def single(**changes: NDArray) -> dict[str, NDArray]:
    time = 0.001 * np.arange(SAMPLES)
    return {"time": time, "position": np.sin(time), "effort": np.cos(time), **changes}


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".mf4"])
def test_two_axes_come_back_from_a_file_to_the_last_bit(tmp_path: Path, suffix: str) -> None:
    record = two_axes()
    write_axis_record(record, tmp_path / f"axes{suffix}")
    found = read_axis_record(tmp_path / f"axes{suffix}")
    assert [axis.name for axis in found.axes] == ["1", "2"]
    np.testing.assert_array_equal(found.time, record.time)
    np.testing.assert_array_equal(found.period, record.period)
    assert found.sample_time == pytest.approx(0.001)
    for one, other in zip(record.axes, found.axes, strict=True):
        np.testing.assert_array_equal(one.position, other.position)
        np.testing.assert_array_equal(one.effort, other.effort)
        if suffix != ".csv":
            assert one.kind is other.kind


def test_a_csv_file_states_no_units_and_is_what_the_reader_says(tmp_path: Path) -> None:
    write_axis_record(two_axes(), tmp_path / "axes.csv")
    for kind in AxisKind:
        assert {axis.kind for axis in read_axis_record(tmp_path / "axes.csv", kind).axes} == {kind}


def test_a_csv_file_may_state_units_in_brackets_behind_the_names(tmp_path: Path) -> None:
    rows = "\n".join(f"{0.001 * number},{number},{number},{number},{number}" for number in range(SAMPLES))
    header = "time [s],position_1[rad], effort_1 [Nm] ,position_2 [m],effort_2"
    (tmp_path / "axes.csv").write_text(f"{header}\n{rows}\n")
    first, second = read_axis_record(tmp_path / "axes.csv").axes
    assert (first.name, first.kind) == ("1", AxisKind.ROTARY)
    assert (second.name, second.kind) == ("2", AxisKind.LINEAR)


def test_a_csv_file_in_degrees_is_refused_with_the_unit_wanted(tmp_path: Path) -> None:
    (tmp_path / "axis.csv").write_text("time,position [deg],effort [Nm]\n" + "0,0,0\n" * SAMPLES)
    with pytest.raises(RecordError, match=r"'deg'") as raised:
        read_axis_record(tmp_path / "axis.csv")
    assert "'rad'" in raised.value.remedy


def test_a_csv_file_of_a_spreadsheet_may_begin_with_a_byte_order_mark(tmp_path: Path) -> None:
    write_axis_record(two_axes(), tmp_path / "axes.csv")
    (tmp_path / "axes.csv").write_text((tmp_path / "axes.csv").read_text(), encoding="utf-8-sig")
    assert len(read_axis_record(tmp_path / "axes.csv").axes) == 2


@pytest.mark.parametrize("mark", [";", "\t"])
def test_channels_that_are_not_separated_by_commas_are_refused_with_the_remedy(tmp_path: Path, mark: str) -> None:
    write_axis_record(two_axes(), tmp_path / "axes.csv")
    (tmp_path / "axes.csv").write_text((tmp_path / "axes.csv").read_text().replace(",", mark))
    with pytest.raises(RecordError, match="not separated by commas"):
        read_axis_record(tmp_path / "axes.csv")


@pytest.mark.parametrize("suffix", [".parquet", ".mf4"])
def test_a_file_that_was_cut_off_is_refused_and_nothing_else_is_said(
    tmp_path: Path, suffix: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The destructor of a reader that fails as well must not add its own story."""
    said: list[object] = []
    monkeypatch.setattr(sys, "unraisablehook", said.append)
    path = tmp_path / f"axes{suffix}"
    write_axis_record(two_axes(), path)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(RecordError, match=r"not a readable|cut off"):
        read_axis_record(path)
    gc.collect()
    assert not said


def test_a_parquet_file_with_a_hole_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "axis.parquet"
    write_axis_record(two_axes(), path)
    content = bytearray(path.read_bytes())
    content[4:200] = b"\xff" * 196
    path.write_bytes(content)
    with pytest.raises(RecordError, match="not a readable Parquet file"):
        read_axis_record(path)


def test_a_single_axis_has_no_name_and_need_not_be_named() -> None:
    record = axis_record_from_channels(Channels(single()), "record")
    assert record.axis() is record.axis("") is record.axes[0]
    assert set(record.period.tolist()) == {-1}


def test_of_several_axes_one_must_be_named() -> None:
    record = two_axes()
    assert record.axis("2") is record.axes[1]
    for name in (None, "3"):
        with pytest.raises(RecordError) as caught:
            record.axis(name)
        assert "'1', '2'" in caught.value.remedy


def with_value(values: NDArray, index: int, value: float) -> NDArray:
    changed = values.copy()
    changed[index] = value
    return changed


@pytest.mark.parametrize(
    ("values", "units", "named"),
    [
        ({"time": single()["time"]}, {}, "position, effort"),
        ({"position": np.zeros(40), "effort": np.zeros(40)}, {}, "time"),
        ({**single(), "position_2": np.zeros(40)}, {}, "effort_2"),
        (single(effort=np.zeros(39)), {}, "different lengths"),
        (single(effort=with_value(np.ones(40), 3, np.nan)), {}, "channel effort has 1 samples"),
        (single(position=with_value(np.ones(40), 7, np.inf)), {}, "channel position has 1 samples"),
        (single(time=with_value(single()["time"], 20, 0.0205)), {}, "not uniform"),
        (single(period=with_value(np.zeros(40), 20, 0.5)), {}, "channel period"),
        ({name: values[:9] for name, values in single().items()}, {}, "9 samples"),
        (single(), {"position": "mm", "effort": "N"}, "'mm'"),
        (single(), {"position": "m", "effort": "Nm"}, "'m' and 'Nm'"),
        (single(), {"time": "ms"}, "'ms'"),
    ],
)
def test_a_broken_contract_is_named(values: Mapping[str, NDArray], units: Mapping[str, str], named: str) -> None:
    with pytest.raises(RecordError) as caught:
        axis_record_from_channels(Channels(values, units), "run.csv")
    assert caught.value.what.startswith("run.csv")
    assert named in caught.value.what
    assert caught.value.remedy


def test_a_unit_left_out_follows_from_the_other() -> None:
    record = axis_record_from_channels(Channels(single(), {"effort": "Nm"}), "record")
    assert record.axes[0].kind is AxisKind.ROTARY


def emps_like(**changes: NDArray | float) -> dict[str, NDArray | float]:
    time = (0.001 * np.arange(SAMPLES))[:, None]
    return {"t": time, "qm": np.sin(time), "qg": np.sin(time), "vir": np.cos(time), "gtau": 35.0, **changes}


def test_the_matlab_file_of_the_benchmark_gives_force_by_voltage(tmp_path: Path) -> None:
    content = emps_like()
    io.savemat(tmp_path / "emps.mat", content)
    record = read_axis_record(tmp_path / "emps.mat")
    time = 0.001 * np.arange(SAMPLES)
    np.testing.assert_allclose(record.axes[0].effort, 35.0 * np.cos(time))
    np.testing.assert_allclose(record.axes[0].position, np.sin(time))
    assert record.axes[0].kind is AxisKind.LINEAR


def test_another_matlab_file_is_refused_with_what_it_lacks(tmp_path: Path) -> None:
    content = emps_like()
    del content["gtau"]
    io.savemat(tmp_path / "other.mat", content)
    with pytest.raises(RecordError, match="lacks the variable gtau"):
        read_axis_record(tmp_path / "other.mat")


@pytest.mark.parametrize("content", [b"", b"MATLAB 7.3 MAT-file", bytes(range(256)) * 4])
def test_what_is_no_matlab_file_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "broken.mat").write_bytes(content)
    with pytest.raises(RecordError, match=r"broken\.mat"):
        read_axis_record(tmp_path / "broken.mat")


@pytest.mark.parametrize("name", ["none.mat", "none.csv"])
def test_a_missing_file_is_named(tmp_path: Path, name: str) -> None:
    with pytest.raises(RecordError, match="does not exist"):
        read_axis_record(tmp_path / name)


def test_an_unknown_ending_is_named(tmp_path: Path) -> None:
    with pytest.raises(RecordError, match=r"\.txt"):
        read_axis_record(tmp_path / "axes.txt")


def test_blank_lines_at_the_end_of_a_csv_file_and_other_channels_of_words_are_passed_over(tmp_path: Path) -> None:
    path = tmp_path / "axis.csv"
    rows = [f"{0.01 * i:.2f},{i * i},1.5,slow" for i in range(20)]
    path.write_text("\n".join(["time,position,effort,remark", *rows, "", " ", ""]))
    assert len(read_axis_record(path)) == 20


def test_words_in_a_channel_that_is_needed_are_refused_with_the_first_of_them(tmp_path: Path) -> None:
    path = tmp_path / "axis.csv"
    rows = [f"{0.01 * i:.2f},{'none' if i == 7 else i},1.5" for i in range(20)]
    path.write_text("\n".join(["time,position,effort", *rows]))
    with pytest.raises(RecordError, match="channel position holds 'none' at sample 7"):
        read_axis_record(path)

"""`quasiomni diagnose`: ten lines, a JSON that programs read, a page that needs nothing else, and clear refusals."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import signal

from ident.diagnosis.vehicle.experiment.ideal import FOUR, ideal_record
from ident.parameters_file import read_model
from ident.records.channels import Channels, write_channels
from ident.records.files import write_record
from ident.records.record import Record
from ident.vehicle.description import load_vehicle
from ident.vehicle.quantities import read_toml

Quasi = Callable[..., Any]


def _axis(seed: int, *, asymmetry: float = 6.0) -> dict[str, np.ndarray]:
    """A carriage of 10 kg whose friction is larger forward than backward."""
    generator = np.random.default_rng(seed)
    strokes = np.repeat(generator.choice([0.1, 0.2, 0.3], 24) * np.tile([1.0, -1.0], 12), 250)
    window = signal.windows.hann(80)
    velocity = signal.convolve(strokes, window / window.sum(), mode="same")
    position = np.cumsum(velocity) * 2e-3
    acceleration = np.gradient(velocity, 2e-3)
    effort = 10 * acceleration + 30 * velocity + 5 * np.sign(velocity) + asymmetry * np.abs(velocity)
    effort = effort + 0.1 * generator.normal(size=len(effort))
    return {"time": np.arange(len(effort)) * 2e-3, "position": position, "effort": effort}


@pytest.fixture
def record(tmp_path: Path) -> Callable[..., Path]:
    def write(seed: int, name: str = "", **changes: Any) -> Path:
        path = tmp_path / (name or f"axis{seed}.csv")
        write_channels(Channels({**_axis(seed), **changes}), path)
        return path

    return write


def test_the_answer_fits_ten_lines_and_the_files_say_the_same(
    quasi: Quasi, record: Callable[..., Path], tmp_path: Path
) -> None:
    out, page = tmp_path / "diagnosis.json", tmp_path / "report.html"
    answer = quasi("diagnose", record(1), "--confirm", record(2), "--axis", "--json", out, "--report", page)
    assert answer.code == 0
    lines = answer.out.strip().splitlines()
    assert len([line for line in lines if not line.startswith("Written")]) <= 10
    assert "viscous friction" in lines[0]
    content = json.loads(out.read_text())
    assert content["verdict"] == "effect"
    assert content["effects"][0]["name"] == "asymmetric_viscous"
    assert content["effects"][0]["parameters"]["imbalance"]["value"] == pytest.approx(6.0, rel=0.1)
    text = page.read_text()
    assert "viscous friction" in text
    assert "<script src" not in text
    assert '<link rel="stylesheet"' not in text


def test_one_record_alone_is_diagnosed_too(quasi: Quasi, record: Callable[..., Path]) -> None:
    answer = quasi("diagnose", record(3), "--axis")
    assert answer.code == 0
    assert "asymmetric_viscous@" in answer.out


def _refused(quasi: Quasi, tmp_path: Path, *arguments: object) -> str:
    """What it complains about; no JSON is left, not even half of one."""
    out = tmp_path / "diagnosis.json"
    answer = quasi("diagnose", *arguments, "--json", out)
    assert answer.code == 2
    assert "error:" in answer.error
    assert "remedy:" in answer.error
    assert not out.exists()
    assert not list(tmp_path.glob(".*.part"))
    return str(answer.error)


def test_a_missing_channel_is_named(quasi: Quasi, tmp_path: Path) -> None:
    path = tmp_path / "part.csv"
    values = _axis(1)
    write_channels(Channels({"time": values["time"], "position": values["position"]}), path)
    assert "effort" in _refused(quasi, tmp_path, path, "--axis")


def test_a_value_that_is_no_number_is_named(quasi: Quasi, record: Callable[..., Path], tmp_path: Path) -> None:
    effort = _axis(1)["effort"]
    effort[77] = np.nan
    assert "effort" in _refused(quasi, tmp_path, record(1, effort=effort), "--axis")


def test_time_that_jumps_is_refused(quasi: Quasi, record: Callable[..., Path], tmp_path: Path) -> None:
    time = _axis(1)["time"]
    time[500:] += 0.01
    assert "not uniform" in _refused(quasi, tmp_path, record(1, time=time), "--axis")


def test_records_of_axes_may_have_different_rates(quasi: Quasi, record: Callable[..., Path]) -> None:
    slower = record(2, **{name: values[::2] for name, values in _axis(2).items()})
    answer = quasi("diagnose", record(1), "--confirm", slower, "--axis")
    assert answer.code == 0
    assert "asymmetric_viscous@" in answer.out


def test_an_axis_that_does_not_move_is_refused(quasi: Quasi, record: Callable[..., Path], tmp_path: Path) -> None:
    still = record(1, position=np.full(6000, 0.1))
    assert "does not move" in _refused(quasi, tmp_path, still, "--axis")


@pytest.mark.parametrize("name", ["axis1.csv", "copy.csv"])
def test_a_record_cannot_confirm_itself_under_any_name(
    quasi: Quasi, record: Callable[..., Path], tmp_path: Path, name: str
) -> None:
    first = record(1)
    shifted = record(1, name, time=_axis(1)["time"] + (0.0 if name == "axis1.csv" else 100.0))
    assert "the same samples" in _refused(quasi, tmp_path, first, "--confirm", shifted, "--axis")


def test_a_record_that_is_not_there_is_named(quasi: Quasi, tmp_path: Path) -> None:
    assert "nowhere.csv" in _refused(quasi, tmp_path, tmp_path / "nowhere.csv", "--axis")


def test_a_model_of_the_platform_is_no_model_of_an_axis(
    quasi: Quasi, record: Callable[..., Path], tmp_path: Path
) -> None:
    assert "--model" in _refused(quasi, tmp_path, record(1), "--axis", "--model", tmp_path / "parameters.toml")


def test_it_is_said_when_the_kind_of_an_axis_is_assumed(quasi: Quasi, record: Callable[..., Path]) -> None:
    assert "position [rad]" in quasi("diagnose", record(3), "--axis").out
    stated = record(3, "stated.csv")
    stated.write_text(stated.read_text().replace("position", "position [m]", 1))
    assert "position [rad]" not in quasi("diagnose", stated, "--axis").out


def test_a_folder_cannot_be_written_over(quasi: Quasi, record: Callable[..., Path], tmp_path: Path) -> None:
    answer = quasi("diagnose", record(3), "--axis", "--json", tmp_path)
    assert answer.code == 2
    assert "is a folder" in answer.error


def _platform(seed: int, path: Path) -> Path:
    """A record of the four steps whose motor fr gives 0.05 Nm more than its drive reports."""
    generator = np.random.default_rng(seed)
    segments = []
    for segment in ideal_record(FOUR, load_vehicle("prototype"), seed).segments:
        noise = 0.01 * generator.normal(size=segment.motor_torques.shape)
        torques = segment.motor_torques - np.array([0, 0, 0.05, 0]) + noise
        segments.append(replace(segment, motor_torques=torques))
    write_record(Record(segments, path.name), path)
    return path


def test_the_model_with_its_effects_is_written_for_every_command_that_takes_a_model(
    quasi: Quasi, tmp_path: Path
) -> None:
    fit, confirm = (_platform(seed, tmp_path / f"run{seed}.parquet") for seed in (1, 2))
    extended = tmp_path / "models" / "extended.toml"
    answer = quasi("diagnose", fit, "--confirm", confirm, "--extended", extended)
    assert answer.code == 0
    assert "outcome" in answer.out
    effect = read_model(extended).effects[0]
    assert effect.where in ("drive_fr", "wheel_fr")
    assert read_toml(extended)["source"] == {"run": "diagnosis", "records": fit.name, "confirm": confirm.name}
    judged = quasi("diagnose", fit, "--confirm", confirm, "--model", extended, "--extended", tmp_path / "again.toml")
    assert "Nothing is missing" in judged.out
    assert "again.toml is not written: no effect is named." in " ".join(judged.out.split())
    assert not (tmp_path / "again.toml").exists()


def test_the_model_of_an_axis_is_written_with_its_effects(
    quasi: Quasi, record: Callable[..., Path], tmp_path: Path
) -> None:
    extended = tmp_path / "extended.toml"
    answer = quasi("diagnose", record(1), "--confirm", record(2), "--axis", "--extended", extended)
    assert answer.code == 0
    axis = read_toml(extended)["axis"]
    assert axis["parameters"]["M"]["value"] == pytest.approx(10.0, rel=0.02)
    (effect,) = axis["effects"]
    assert (effect["name"], effect["where"]) == ("asymmetric_viscous", "axis")
    assert effect["parameters"]["imbalance"]["value"] == pytest.approx(6.0, rel=0.1)


def test_an_axis_without_a_gap_gets_no_extended_model(quasi: Quasi, tmp_path: Path) -> None:
    paths = [tmp_path / f"{seed}.csv" for seed in (1, 2)]
    for seed, path in enumerate(paths, 1):
        write_channels(Channels(_axis(seed, asymmetry=0.0)), path)
    extended = tmp_path / "extended.toml"
    answer = quasi("diagnose", paths[0], "--confirm", paths[1], "--axis", "--extended", extended)
    assert "is not written: no effect is named" in " ".join(answer.out.split())
    assert not extended.exists()


def test_an_axis_is_identified_by_the_command(quasi: Quasi, record: Callable[..., Path], tmp_path: Path) -> None:
    answer = quasi("identify", record(1), "--axis", "--out", tmp_path / "out")
    assert answer.code == 0
    found = read_toml(tmp_path / "out" / "axis.toml")["axis"]["parameters"]
    assert {name: entry["unit"] for name, entry in found.items()} == {
        "M": "kg",
        "Fv": "N s/m",
        "Fc": "N",
        "offset": "N",
    }
    assert found["M"]["value"] == pytest.approx(10.0, rel=0.03)


@pytest.mark.parametrize(
    ("arguments", "said"), [(("--vehicle", "prototype"), "--vehicle"), (("second.csv",), "one record")]
)
def test_axes_are_identified_from_one_record_of_their_own(
    quasi: Quasi, record: Callable[..., Path], tmp_path: Path, arguments: tuple[str, ...], said: str
) -> None:
    answer = quasi("identify", record(1), *arguments, "--axis", "--out", tmp_path / "out")
    assert answer.code == 2
    assert said in answer.error
    assert not (tmp_path / "out").exists()

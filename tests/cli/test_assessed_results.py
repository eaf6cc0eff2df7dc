"""What cannot be true ends with exit code 1, and nothing downstream takes it without --force."""

from __future__ import annotations

import tomllib
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ident.diagnosis.vehicle.experiment.ideal import FOUR, ideal_record
from ident.records.files import write_record
from ident.records.record import Record, Segment
from ident.vehicle.description import load_vehicle

Quasi = Callable[..., Any]
GIVEN = ("--b-w", 0.121, "--b-w-std", 0.002)


@pytest.fixture(scope="module")
def sound() -> Record:
    return ideal_record(FOUR, load_vehicle("prototype"), 1)


@pytest.fixture
def identified(quasi: Quasi, sound: Record, tmp_path: Path) -> Callable[[Callable[[Segment], Segment]], Any]:
    """The answer of `identify` to the sound record with its segments changed."""

    def run(change: Callable[[Segment], Segment]) -> Any:
        path = tmp_path / "record.csv"
        write_record(Record([change(one) for one in sound.segments], path.name), path)
        return quasi("identify", path, *GIVEN, "--out", tmp_path)

    return run


def verdict_in(folder: Path) -> str:
    return str(tomllib.loads((folder / "parameters.toml").read_text())["assessment"]["verdict"])


def test_a_sound_record_is_good(identified: Any, tmp_path: Path) -> None:
    answer = identified(lambda one: one)
    assert answer.code == 0, answer
    assert answer.out.lstrip().startswith("Good:")
    assert verdict_in(tmp_path) == "good"


def test_torques_of_the_other_sign_are_unusable(identified: Any, tmp_path: Path) -> None:
    answer = identified(lambda one: replace(one, motor_torques=-one.motor_torques))
    assert answer.code == 1
    assert answer.out.lstrip().startswith("Unusable:")
    assert "m_ch" in answer.out
    assert "quasiomni diagnose" in answer.out
    assert verdict_in(tmp_path) == "unusable"


def test_a_doubtful_result_ends_well_but_says_so_first(identified: Any, tmp_path: Path) -> None:
    def slips(one: Segment) -> Segment:
        factors = np.array([1.05, 1.0, 1.0, 1.0]) if one.step == "straight" else np.ones(4)
        return replace(one, wheel_angles=one.wheel_angles * factors)

    answer = identified(slips)
    assert answer.code == 0
    assert answer.out.lstrip().startswith("Doubtful:")
    assert verdict_in(tmp_path) == "doubtful"
    assert "doubtful" in (tmp_path / "report.html").read_text()


def test_time_in_milliseconds_is_refused_in_words(identified: Any) -> None:
    answer = identified(lambda one: replace(one, time=1000 * one.time, sample_time=1000 * one.sample_time))
    assert answer.code == 2
    assert "Traceback" not in answer.err
    assert "time is 1000 times what it should be" in answer.error


UNUSABLE = """
[assessment]
verdict = "unusable"

[[assessment.reasons]]
code = "not_positive"
channel = "m_ch"
value = -842.0
limit = 0.0
text = "m_ch = -842 kg: no mass or inertia is negative or zero."
"""


@pytest.fixture
def unusable_model(tmp_path: Path) -> Path:
    path = tmp_path / "parameters.toml"
    path.write_text(UNUSABLE)
    return path


@pytest.fixture
def unusable_fmu(tmp_path: Path) -> Path:
    path = tmp_path / "platform.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("documentation/parameters.toml", UNUSABLE)
    return path


def downstream(model: Path, fmu: Path, out: Path) -> dict[str, tuple[object, ...]]:
    return {
        "diagnose": ("diagnose", model.with_name("record.csv"), "--model", model),
        "cosim": ("cosim", fmu, "--record", model.with_name("record.csv")),
        "campaign": ("campaign", "--plant", f"fmu:{fmu}", "--out", out),
        "emulate": ("emulate", "--plant", f"fmu:{fmu}", "--bus", f"unix:{out}"),
    }


@pytest.mark.parametrize("command", ["diagnose", "cosim", "campaign", "emulate"])
def test_nothing_takes_what_is_unusable(
    quasi: Quasi, unusable_model: Path, unusable_fmu: Path, tmp_path: Path, command: str
) -> None:
    words = downstream(unusable_model, unusable_fmu, tmp_path / "out")[command]
    answer = quasi(*words)
    assert answer.code == 2
    assert "unusable" in answer.error
    assert "--force" in answer.error
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("command", ["diagnose", "cosim"])
def test_by_force_it_is_taken_and_the_next_mistake_is_named(
    quasi: Quasi, unusable_model: Path, unusable_fmu: Path, tmp_path: Path, command: str
) -> None:
    words = downstream(unusable_model, unusable_fmu, tmp_path / "out")[command]
    answer = quasi(*words, "--force")
    assert answer.code == 2
    assert "assessed" not in answer.error
    assert "does not exist" in answer.error or "lacks" in answer.error or "has no table" in answer.error


def test_an_fmu_with_settings_that_nest_too_deep_is_refused_before_it_is_loaded(quasi: Quasi, tmp_path: Path) -> None:
    path = tmp_path / "deep.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("documentation/parameters.toml", "a = " + "[" * 100_000)
    answer = quasi("cosim", path, "--record", tmp_path / "record.csv")
    assert answer.code == 2
    assert "documentation/parameters.toml" in answer.error


def test_a_forced_model_is_not_written_anew_without_its_assessment(
    quasi: Quasi, unusable_model: Path, tmp_path: Path
) -> None:
    extended = tmp_path / "extended.toml"
    answer = quasi("diagnose", tmp_path / "x.csv", "--model", unusable_model, "--force", "--extended", extended)
    assert answer.code == 2
    assert "unusable" in answer.error
    assert not extended.exists()


def test_an_fmu_of_an_unusable_run_is_not_built(quasi: Quasi, tmp_path: Path, unusable_model: Path) -> None:
    from hil.cosimulation.export import source_of_files
    from ident.errors import UserError
    from ident.vehicle.description import find_data_file

    with pytest.raises(UserError, match="unusable"):
        source_of_files(unusable_model, find_data_file("ident.vehicle", "prototype"), {})


def test_every_sample_counts_the_same_time(sound: Record) -> None:
    """What the tests above rely on: the sound record has one rate."""
    assert np.ptp([one.sample_time for one in sound.segments]) == 0.0

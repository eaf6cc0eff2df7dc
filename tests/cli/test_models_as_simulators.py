"""`--from` and `gap`: an identified model as the emulated vehicle, and mistakes that users make with it."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from emulator.prototype import load_prototype
from emulator.vehicle import EmulatedVehicle
from hil.bench.truth import truth_of
from hil.campaign.folder import open_run
from ident.effects import Effect
from ident.effects.extended import ExtendedModel
from ident.effects.text import parse_effect
from ident.parameters_file import write_model
from ident.records.files import write_record
from ident.records.record import Record, Segment, Step, make_segment
from ident.vehicle.description import load_vehicle

Quasi = Callable[..., Any]

DT, PERIODS, PERIOD = 0.002, 4, 1000
BIAS = "torque_bias@drive_fl=0.1Nm"


def assert_user_error(answer: Any, *words: str) -> None:
    assert answer.code == 2, answer
    assert "Traceback" not in answer.err + answer.out
    assert "remedy:" in answer.error
    for word in words:
        assert word in answer.error, answer.error


def model_file(path: Path, effects: Sequence[Effect] = (), vehicle: str = "prototype") -> Path:
    write_model(
        ExtendedModel(truth_of("prototype"), tuple(effects)),
        path,
        {"run": "test"},
        geometry=load_vehicle(vehicle).geometry,
    )
    return path


@pytest.fixture
def plain(tmp_path: Path) -> Path:
    return model_file(tmp_path / "plain.toml")


@pytest.fixture
def extended(tmp_path: Path) -> Path:
    return model_file(tmp_path / "extended.toml", [parse_effect(BIAS)])


@pytest.fixture(scope="module")
def record() -> Record:
    """Two seconds of driving to and fro, four times, of a vehicle that has the bias; load and sensors with noise."""
    prototype, rows = load_prototype(), []
    gear, directions = prototype.geometry.gear_ratio, prototype.drive.directions
    with EmulatedVehicle(prototype, seed=3, effects=(parse_effect(BIAS),)) as vehicle:
        for drive in vehicle.drives:
            drive.enable()
        for cycle in range(PERIODS * PERIOD):
            for drive, direction in zip(vehicle.drives, directions, strict=True):
                drive.command(direction * 0.8 * math.sin(math.pi * cycle * DT))
            torques = [drive.wheel_torque / gear for drive in vehicle.drives]
            rows.append([*torques, *vehicle.ground_truth().wheel_angles, *vehicle.ground_truth().steering_angles])
            vehicle.advance(DT)
    table = np.array(rows) + np.random.default_rng(2).normal(0.0, [6e-3] * 4 + [2e-5] * 6, (len(rows), 10))
    period = np.repeat(np.arange(PERIODS), PERIOD)
    time = np.arange(len(rows)) * DT
    segment = Segment(Step.STRAIGHT, 0.0, time, table[:, :4], table[:, 4:8], table[:, 8:], period)
    return Record([make_segment(segment, "test")])


@pytest.fixture
def driven(record: Record, tmp_path: Path) -> Path:
    path = tmp_path / "record.csv"
    write_record(record, path)
    return path


def test_gap_says_where_and_by_how_much_and_draws_it(
    quasi: Quasi, driven: Path, plain: Path, extended: Path, tmp_path: Path
) -> None:
    numbers, page = tmp_path / "gap.json", tmp_path / "gap.html"
    answer = quasi("gap", driven, "--simulator", extended, "--before", plain, "--json", numbers, "--report", page)
    assert answer.code == 0, answer.err
    assert "times the noise before" in answer.out
    document = json.loads(numbers.read_text())
    (step,) = document["steps"]
    assert (step["step"], step["coordinate"]) == ("straight", "x")
    assert document["total"]["before"] > 5
    assert document["total"]["closed"] > 0.95
    assert document["effects"] == ["torque_bias@drive_fl"]
    assert "torque_bias@drive_fl" in page.read_text()


def test_without_a_model_of_before_it_is_the_vehicle_file(
    quasi: Quasi, driven: Path, extended: Path, tmp_path: Path
) -> None:
    numbers = tmp_path / "gap.json"
    assert quasi("gap", driven, "--simulator", extended, "--json", numbers).code == 0
    assert "prototype.toml" in json.loads(numbers.read_text())["before"]


def test_a_model_without_effects_can_be_judged_as_well(quasi: Quasi, driven: Path, plain: Path, extended: Path) -> None:
    answer = quasi("gap", driven, "--simulator", plain, "--before", extended)
    assert answer.code == 0, answer.err
    assert "no effects" in answer.out


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (None, ("does not exist",)),
        ("this is no TOML", ("wrong.toml",)),
        ("[parameters]\n", ("wrong.toml", "C_l")),
    ],
    ids=["missing", "no TOML", "empty"],
)
@pytest.mark.parametrize("command", ["campaign", "emulate", "gap"])
def test_a_file_that_is_no_model_is_refused_before_anything_moves(
    quasi: Quasi, driven: Path, tmp_path: Path, command: str, text: str | None, words: tuple[str, ...]
) -> None:
    wrong, out = tmp_path / "wrong.toml", tmp_path / "out"
    if text is not None:
        wrong.write_text(text)
    commands = {
        "campaign": ("campaign", "--from", wrong, "--out", out),
        "emulate": ("emulate", "--from", wrong, "--bus", f"unix:{out}"),
        "gap": ("gap", driven, "--simulator", wrong, "--json", out),
    }
    assert_user_error(quasi(*commands[command]), *words)
    assert not out.exists()


def test_a_model_of_another_vehicle_is_refused(quasi: Quasi, driven: Path, tmp_path: Path) -> None:
    other, out = model_file(tmp_path / "other.toml", vehicle="compact"), tmp_path / "out"
    steps = ("--skip", "rotation", "--skip", "lane_change", "--skip", "straight")
    for words in (
        ("gap", driven, "--simulator", other, "--json", out),
        ("emulate", "--from", other, "--bus", f"unix:{out}"),
    ):
        assert_user_error(quasi(*words), "another vehicle", "wheelbase")
    assert_user_error(quasi("campaign", "--from", other, "--out", out, *steps), "another vehicle")
    assert not out.exists()


def test_an_effect_that_the_vehicle_cannot_have_is_refused_before_anything_moves(
    quasi: Quasi, driven: Path, tmp_path: Path
) -> None:
    steep, out = model_file(tmp_path / "steep.toml", [parse_effect("slope@chassis=5deg")]), tmp_path / "out"
    for words in (
        ("gap", driven, "--simulator", steep, "--json", out),
        ("emulate", "--from", steep, "--bus", f"unix:{out}"),
    ):
        assert_user_error(quasi(*words), "steep.toml", "roll away", "[[effects]]")
    assert not out.exists()


@pytest.mark.parametrize("other", [("--bus", "virtual:x"), ("--plant", "fmu:platform.fmu")])
def test_from_stands_beside_no_other_vehicle(
    quasi: Quasi, extended: Path, tmp_path: Path, other: tuple[str, str]
) -> None:
    out = tmp_path / "out"
    assert_user_error(quasi("campaign", "--from", extended, "--out", out, *other), "--from")
    assert not out.exists()


def test_what_was_assessed_as_unusable_is_not_taken(quasi: Quasi, driven: Path, plain: Path, tmp_path: Path) -> None:
    plain.write_text(plain.read_text() + '\n[assessment]\nverdict = "unusable"\n')
    out = tmp_path / "out"
    for words in (
        ("campaign", "--from", plain, "--out", out),
        ("emulate", "--from", plain, "--bus", f"unix:{out}"),
        ("gap", driven, "--simulator", plain, "--json", out),
    ):
        assert_user_error(quasi(*words), "unusable", "--force")
    assert not out.exists()
    assert quasi("gap", driven, "--simulator", plain, "--force").code == 0


def test_gap_writes_over_nothing_that_it_reads(quasi: Quasi, driven: Path, extended: Path) -> None:
    before = extended.read_bytes()
    assert_user_error(quasi("gap", driven, "--simulator", extended, "--json", extended), "extended.toml")
    assert_user_error(quasi("gap", driven, "--simulator", extended, "--report", driven), "record.csv")
    assert extended.read_bytes() == before


def test_a_record_without_a_step_to_simulate_is_refused(
    quasi: Quasi, record: Record, extended: Path, tmp_path: Path
) -> None:
    strange = tmp_path / "strange.csv"
    write_record(replace(record, segments=[replace(record.segments[0], step="parade")]), strange)
    assert_user_error(quasi("gap", strange, "--simulator", extended), "no step to simulate")


@pytest.mark.slow
def test_a_campaign_from_a_model_goes_on_with_the_same_model(quasi: Quasi, extended: Path, tmp_path: Path) -> None:
    """The run carries it: the file may be gone, and another one is refused."""
    out = tmp_path / "run"
    skipped = [word for step in Step if step not in ("steering_left",) for word in ("--skip", str(step))]
    assert quasi("campaign", "--from", extended, "--out", out, *skipped).code == 0
    assert open_run(out).simulator == out / "simulator.toml"
    assert (out / "simulator.toml").read_bytes() == extended.read_bytes()
    assert quasi("campaign", "--resume", "--out", out, "--from", extended).code == 0
    other = model_file(tmp_path / "other.toml", [parse_effect("torque_bias@drive_rl=0.1Nm")])
    assert_user_error(quasi("campaign", "--resume", "--out", out, "--from", other), "--from", "another")
    extended.unlink()
    assert quasi("campaign", "--resume", "--out", out).code == 0

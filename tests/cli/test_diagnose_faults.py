"""`quasiomni diagnose` of a record that is at fault: that is the answer, in the first line, in JSON and on the page."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from ident.diagnosis.vehicle.experiment.ideal import FOUR, ideal_record
from ident.records.files import write_record
from ident.records.record import Record
from ident.vehicle.description import load_vehicle

Quasi = Callable[..., Any]


@pytest.fixture
def sound() -> Record:
    return ideal_record(FOUR, load_vehicle("prototype"), 1)


def test_swapped_torques_are_the_answer_and_no_effect_is(quasi: Quasi, sound: Record, tmp_path: Path) -> None:
    path, out, page = (tmp_path / name for name in ("swapped.csv", "diagnosis.json", "report.html"))
    swapped = [replace(each, motor_torques=each.motor_torques[:, [2, 1, 0, 3]]) for each in sound.segments]
    write_record(Record(swapped, path.name), path)
    answer = quasi("diagnose", path, "--json", out, "--report", page)
    assert answer.code == 0
    assert answer.out.splitlines()[0] == "The record is at fault: torque_fl and torque_fr are swapped."
    content = json.loads(out.read_text())
    assert (content["verdict"], content["effects"]) == ("fault", [])
    assert [(fault["name"], fault["channel"]) for fault in content["faults"]] == [
        ("channel_swapped", "torque_fl/torque_fr")
    ]
    assert "torque_fl and torque_fr are swapped" in page.read_text()


def test_time_in_milliseconds_is_named(quasi: Quasi, sound: Record, tmp_path: Path) -> None:
    path = tmp_path / "ms.csv"
    write_record(Record([replace(each, time=1e3 * each.time) for each in sound.segments], path.name), path)
    assert "time is 1000 times what it should be" in quasi("diagnose", path).out


def test_lost_samples_are_named_where_a_record_is_refused(quasi: Quasi, sound: Record, tmp_path: Path) -> None:
    path = tmp_path / "gap.csv"
    write_record(sound, path)
    lines = path.read_text().splitlines()
    path.write_text("\n".join(lines[:500] + lines[520:]))
    answer = quasi("diagnose", path)
    assert answer.code == 2
    assert "lost_samples: 20 are missing" in answer.error

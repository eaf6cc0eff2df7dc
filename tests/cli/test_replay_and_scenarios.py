"""`emulate --scenario`, `replay` and `convert` as somebody types them, and mistakes in doing so."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import can
import pytest

HOLDS = """
[[setpoint]]
at = 0.1
torque = 0.5

[[expect]]
at = 0.1
that = "moving"
faster_than = 0.02
within = 1.0
"""


def test_a_scenario_exits_by_what_came_of_it_and_writes_what_was_asked_for(quasi: Callable, tmp_path: Path) -> None:
    path, junit, numbers = tmp_path / "day.toml", tmp_path / "junit.xml", tmp_path / "day.json"
    path.write_text(HOLDS)
    answer = quasi("emulate", "--scenario", path, "--junit", junit, "--json", numbers)
    assert answer.code == 0
    assert "day: 1 of 1 expectations hold." in answer.out
    assert "pass: the vehicle to be faster than 0.02 m/s within 1 s from 0.1 s on; at 0." in answer.out
    assert ElementTree.parse(junit).getroot().attrib["failures"] == "0"
    assert json.loads(numbers.read_text())["passed"] is True
    path.write_text(HOLDS.replace("0.02", "9.0"))
    failed = quasi("emulate", "--scenario", path, "--junit", junit)
    assert failed.code == 1
    assert "FAIL: the vehicle to be faster than 9 m/s" in failed.out
    assert ElementTree.parse(junit).getroot().attrib["failures"] == "1"


MISTAKES = {
    "a scenario that is not there": (("emulate", "--scenario", "no.toml"), "no.toml does not exist"),
    "a bus for a scenario that drives itself": (
        ("emulate", "--scenario", "day.toml", "--bus", "unix:/tmp/never"),
        "serves no bus: --bus does nothing",
    ),
    "results without a scenario": (("emulate", "--junit", "x.xml"), "of a scenario"),
    "results over the scenario": (("emulate", "--scenario", "day.toml", "--json", "day.toml"), "read by this very"),
    "another plant": (
        ("emulate", "--scenario", "day.toml", "--plant", "fmu:x.fmu"),
        "--plant cannot be watched",
    ),
    "a log that is not there": (("replay", "no.blf"), "no.blf does not exist"),
    "a record for a log": (("replay", "record.csv"), "no log of a known format"),
    "a folder that is no run": (("replay", "."), "no run folder"),
    "a report over the log": (("replay", "drive.log", "--report", "drive.log"), "read by this very command"),
    "a log of another network": (("replay", "drive.log"), "has no samples of node 1 (drive_fl)"),
    "a format that is none": (("convert", "drive.log", "-o", "drive.xyz"), "ends in '.xyz'"),
    "somebody else's MCAP": (("convert", "foreign.mcap", "-o", "x.csv"), "foreign.mcap"),
    "frames that are none": (("convert", "record.csv", "-o", "x.blf"), "holds no frames"),
}


@pytest.mark.parametrize(("words", "said"), MISTAKES.values(), ids=MISTAKES)
def test_mistakes_are_two_lines_with_a_remedy_and_leave_nothing(
    quasi: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], said: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("day.toml").write_text(HOLDS)
    Path("record.csv").write_text("time,step\n0,straight\n")
    Path("foreign.mcap").write_bytes(b"\x89MCAP0\r\nand then nothing of the kind")
    with can.CanutilsLogWriter(Path("drive.log")) as writer:
        writer.on_message_received(can.Message(1.0, 0x0C1, is_extended_id=False, data=b"\x01"))
        writer.on_message_received(can.Message(1.1, 0x080, is_extended_id=False))
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    answer = quasi(*words)
    assert answer.code == 2
    assert said in answer.error
    assert "remedy:" in answer.error
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before

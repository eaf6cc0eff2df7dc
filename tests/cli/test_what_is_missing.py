"""What is not installed is said before the work, by the command that needs it and by `doctor`."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest


def test_the_command_says_it_for_people_and_programs(
    quasi: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    fine = quasi("doctor", "python", "dbc", "--json")
    assert (fine.code, json.loads(fine.out)["ok"]) == (0, True)
    monkeypatch.setitem(sys.modules, "cantools", None)
    lacking = quasi("doctor", "python", "dbc", "--json")
    checks = {check["name"]: check for check in json.loads(lacking.out)["checks"]}
    assert lacking.code == 1
    assert (checks["python"]["found"], checks["dbc"]["found"]) == (True, False)
    assert "quasiomni[dbc]" in checks["dbc"]["remedy"]
    shown = quasi("doctor", "dbc")
    assert shown.code == 1
    assert "cantools" in shown.out
    assert "quasiomni[dbc]" in shown.out


ENGINES = "pybullet mujoco"
"""One of them is enough where none is asked for; the first is named."""

CASES = {
    "demo": (ENGINES, "emulator", ["demo", "--out", "OUT"]),
    "demo on MuJoCo": ("mujoco", "mujoco", ["demo", "--out", "OUT", "--engine", "mujoco"]),
    "demo on PyBullet": ("pybullet", "emulator", ["demo", "--out", "OUT", "--engine", "pybullet"]),
    "campaign": ("durand", "emulator", ["campaign", "--out", "OUT"]),
    "campaign in MF4": ("asammdf", "records", ["campaign", "--out", "OUT", "--format", ".mf4"]),
    "campaign on an FMU": ("fmpy", "cosim", ["campaign", "--out", "OUT", "--plant", "fmu:x.fmu"]),
    "emulate": (ENGINES, "emulator", ["emulate", "--bus", "unix:OUT"]),
    "emulate an FMU": ("fmpy", "cosim", ["emulate", "--bus", "unix:OUT", "--plant", "fmu:x.fmu"]),
    "demo with a video": ("av", "video", ["demo", "--out", "OUT", "--video", "OUT.mp4"]),
    "campaign with a video": ("PIL", "video", ["campaign", "--out", "OUT", "--video", "OUT.mp4"]),
    "convert to MCAP": ("mcap", "mcap", ["convert", "record.csv", "--out", "OUT.mcap"]),
    "emulate with a video": ("av", "video", ["emulate", "--bus", "unix:OUT", "--video", "OUT.mp4"]),
    "campaign with a page": ("viser", "web", ["campaign", "--out", "OUT", "--web"]),
    "emulate with a page": ("viser", "web", ["emulate", "--bus", "unix:OUT", "--web"]),
    "cosim": ("fmpy", "cosim", ["cosim", "x.fmu", "--record", "x.csv"]),
    "identify from MF4": ("asammdf", "records", ["identify", "x.csv", "x.mf4"]),
    "diagnose from Parquet": ("pyarrow", "records", ["diagnose", "x.csv", "--confirm", "x.parquet"]),
    "dbc": ("cantools", "dbc", ["dbc", "--out", "OUT"]),
    "exam seal": ("cryptography", "exam", ["exam", "seal", "--out", "OUT", "--key", "OUT.key"]),
    "exam diagnose": ("pyarrow", "exam", ["exam", "diagnose", "OUT"]),
    "exam on a cluster": ("distributed", "cluster", ["exam", "diagnose", "OUT", "--scheduler", "tcp://localhost:1"]),
}


@pytest.mark.parametrize(("module", "extra", "words"), CASES.values(), ids=CASES)
def test_a_missing_extra_is_said_before_the_work(
    quasi: Callable[..., Any],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    module: str,
    extra: str,
    words: list[str],
) -> None:
    for name in module.split():
        monkeypatch.setitem(sys.modules, name, None)
    answer = quasi(*(word.replace("OUT", str(tmp_path / "out")) for word in words))
    assert answer.code == 2
    assert f"needs {module.split()[0]}" in answer.error
    assert f"quasiomni[{extra}]" in answer.error
    assert answer.out == ""
    assert list(tmp_path.iterdir()) == []

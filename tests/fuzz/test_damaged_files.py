"""Damaged files of every format are refused by name, or answered rightly; none breaks, hangs or fills the memory."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
FORMATS = 17
MEMORY = 1.5e9
"""Of the process that reads, libraries and all [bytes]; the largest bomb unpacks to 3 GB."""


def fuzzed(tmp_path: Path, copies: int, seed: int) -> dict[str, Any]:
    out = tmp_path / "outcomes.json"
    order = [sys.executable, str(Path(__file__).with_name("run.py"))]
    subprocess.run(
        [*order, "--copies", str(copies), "--seed", str(seed), "--out", str(out)],
        check=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])},
        stdout=subprocess.DEVNULL,
    )
    summary: dict[str, Any] = json.loads(out.read_text())
    return summary


def assert_sound(summary: dict[str, Any], copies: int) -> None:
    assert summary["faults"] == []
    assert summary["copies"] == copies + FORMATS
    assert summary["how"]["answered"] >= FORMATS
    assert summary["how"]["refused"] > copies / 2
    assert summary["peak"] < MEMORY


def test_some_damaged_files_of_every_format(tmp_path: Path) -> None:
    """The hand-made ones first, then two of every format."""
    assert_sound(fuzzed(tmp_path, 55, 7), 55)


@pytest.mark.slow
def test_a_thousand_damaged_files(tmp_path: Path) -> None:
    assert_sound(fuzzed(tmp_path, 1000, 1), 1000)

"""The example suite of the documentation holds, as a user runs it."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

SUITE = Path(__file__).parents[3] / "examples" / "hil_suite"


def test_the_example_suite_passes_and_says_so_in_junit(tmp_path: Path) -> None:
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        str(SUITE),
        "-c",
        str(SUITE / "pytest.ini"),
    ]
    reports = [f"--junitxml={tmp_path / 'junit.xml'}", f"--hil-artifacts={tmp_path / 'artifacts'}"]
    done = subprocess.run([*command, *reports], capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stdout[-5000:]
    tests = len(re.findall(r"^def test_", (SUITE / "test_vehicle_controller.py").read_text(), re.MULTILINE))
    assert (tmp_path / "junit.xml").read_text().count("<testcase ") == tests
    assert not (tmp_path / "artifacts").exists()

"""Two cores answer one exam: each keeps its answers apart, and one table has both."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from hil.exam.folder import Core, ExamFolder

ROOT = Path(__file__).parents[3]


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *arguments], capture_output=True, text=True, timeout=600, check=False, cwd=ROOT
    )


def quasiomni(*arguments: str) -> subprocess.CompletedProcess[str]:
    return run("-m", "quasiomni", *arguments)


@pytest.mark.parametrize("removed", [False, True])
def test_answers_of_two_cores_lie_apart(tmp_path: Path, removed: bool) -> None:
    places = {ExamFolder(tmp_path, core).diagnosis("a", removed) for core in Core}
    assert len(places) == len(Core)
    assert ExamFolder(tmp_path).diagnosis("a", removed) in places


@pytest.mark.slow
def test_both_answer_the_same_records_and_one_table_has_both(tmp_path: Path) -> None:
    out = tmp_path / "exam"
    kinds = ("--effects", "1", "--pairs", "0", "--none", "1", "--laws", "0", "--jobs", "1", "--first-seed", "6200001")
    sealed = quasiomni("exam", "seal", "--source", "axes", "--out", str(out), *kinds)
    assert sealed.returncode == 0, sealed.stderr
    for core in Core:
        diagnosed = quasiomni("exam", "diagnose", str(out), "--jobs", "1", "--core", core)
        assert diagnosed.returncode == 0, diagnosed.stderr
    scored = quasiomni("exam", "score", str(out), "--core", "one")
    assert scored.returncode == 0, scored.stderr
    assert json.loads((out / "one" / "score.json").read_text())["cases"] == 2
    assert not (out / "score.json").exists()
    table = run("examples/cores_side_by_side.py", str(out))
    assert table.returncode == 0, table.stderr
    assert table.stdout.startswith("| 2 cases, 0 of them")
    assert "| standing | one |" in table.stdout

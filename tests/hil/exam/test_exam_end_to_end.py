"""An exam of five cases from drawing to score, with the command line, in processes of their own."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from hil.exam.folder import RECORDS, ExamFolder, read_exam
from hil.exam.score_names import FALSE_ALARMS, REJECTED, RIGHT
from ident.records.files import read_record

pytestmark = pytest.mark.slow

KINDS = {"effects": 1, "pairs": 0, "none": 1, "unknown": 1, "invisible": 0, "laws": 1, "faults": 1}
CASES = [*(part for kind, count in KINDS.items() for part in (f"--{kind}", str(count))), "--excitations", "2"]


def quasiomni(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "quasiomni", *arguments], capture_output=True, text=True, timeout=1800, check=False
    )


def key_of(folder: ExamFolder) -> list[str]:
    return ["--key", str(folder.path.parent / "exam.key")]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> ExamFolder:
    folder = ExamFolder(tmp_path_factory.mktemp("exam") / "exam")
    sealed = quasiomni("exam", "seal", "--out", str(folder.path), *key_of(folder), "--jobs", "1", *CASES)
    assert sealed.returncode == 0, sealed.stderr
    return folder


def test_all_records_have_one_size_and_one_date(folder: ExamFolder) -> None:
    for which in RECORDS:
        stats = [folder.record(name, which).stat() for name in read_exam(folder).identifiers]
        assert len({(stat.st_size, stat.st_mtime) for stat in stats}) == 1


def test_a_record_holds_the_four_steps_with_their_repeats_and_a_lane_change(folder: ExamFolder) -> None:
    for which in RECORDS:
        record = read_record(folder.record(read_exam(folder).identifiers[0], which))
        assert record.steps == ["steering_left", "steering_right", "straight", "rotation", "lane_change"]
        assert all(segment.periods == [0, 1, 2, 3] for segment in record.segments[:-1])


def test_sealing_again_changes_nothing(folder: ExamFolder) -> None:
    before = folder.answer.read_bytes()
    again = quasiomni("exam", "seal", "--out", str(folder.path), *key_of(folder), "--jobs", "1", *CASES)
    assert again.returncode == 0, again.stderr
    assert folder.answer.read_bytes() == before


def test_another_exam_is_not_sealed_into_the_same_folder(folder: ExamFolder) -> None:
    other = quasiomni("exam", "seal", "--out", str(folder.path), "--first-seed", "7", "--jobs", "1", *CASES)
    assert other.returncode == 2
    assert "holds a sealed exam" in " ".join(other.stderr.split())


def test_the_exam_is_diagnosed_and_scored(folder: ExamFolder) -> None:
    for option in ([], ["--without-true-candidate", *key_of(folder)]):
        diagnosed = quasiomni("exam", "diagnose", str(folder.path), "--jobs", "1", *option)
        assert diagnosed.returncode == 0, diagnosed.stderr
    answers = [json.loads(folder.diagnosis(name).read_text()) for name in read_exam(folder).identifiers]
    assert all(answer["verdict"] in ("effect", "law", "none", "unknown", "fault") for answer in answers)
    assert all(len(answer["alone"]) > 10 for answer in answers if answer["verdict"] != "fault")
    assert len(list((folder.path / "diagnoses_without").iterdir())) == 1
    scored = quasiomni("exam", "score", str(folder.path), *key_of(folder))
    assert scored.returncode == 0, scored.stderr
    score = json.loads((folder.path / "score.json").read_text())
    assert score["cases"] == len(answers)
    assert score["sealed"] is True
    assert score["missing"] == {}
    assert [score["rates"][name][1] for name in (FALSE_ALARMS, REJECTED, RIGHT)] == [1, 1, 1]
    assert sum(count for _, _, count in score["confusion"]) == len(answers)
    assert all((folder.path / name).is_file() for name in ("score.md", "reliability.svg", "confusion.svg"))

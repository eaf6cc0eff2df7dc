"""The commands that write EDS, DCF and DBC files and replay the conformance trace."""

from __future__ import annotations

import os
from pathlib import Path

import cantools
import pytest

TRACE = os.environ.get("QUASIOMNI_CIA_TRACE", "")


def test_eds_and_dcf_files_are_written_and_named(quasi, tmp_path: Path) -> None:
    answer = quasi("eds", "--out", tmp_path / "files")
    assert answer.code == 0
    names = sorted(path.name for path in (tmp_path / "files").iterdir())
    assert names[:2] == ["01_drive_fl.dcf", "02_drive_rl.dcf"]
    assert names[-2:] == ["drive.eds", "encoder.eds"]


def test_a_dbc_is_written(quasi, tmp_path: Path) -> None:
    answer = quasi("dbc", "--out", tmp_path / "vehicle.dbc")
    assert answer.code == 0
    assert cantools.database.load_file(tmp_path / "vehicle.dbc").get_message_by_name("drive_fl_TPDO1").length == 8


def test_a_trace_without_cases_is_named(quasi, tmp_path: Path) -> None:
    (tmp_path / "trace.md").write_text("nothing\n")
    answer = quasi("conformance", tmp_path / "trace.md")
    assert answer.code == 2
    assert "trace.md" in answer.error
    assert "remedy:" in answer.error


@pytest.mark.skipif(not TRACE, reason="QUASIOMNI_CIA_TRACE does not name the trace")
def test_the_trace_is_replayed(quasi, tmp_path: Path) -> None:
    answer = quasi("conformance", TRACE, "--out", tmp_path / "page.md")
    assert answer.code == 0
    assert "127 cases" in answer.out
    assert (tmp_path / "page.md").read_text().count("\n| ") > 127
